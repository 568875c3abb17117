/** The bare drawing library: the same surfaces seen from behind a robot that drives, in a canvas of a given size, and nothing else. */

import { MeshBasicMaterial, Mesh, PerspectiveCamera, Scene, WebGLRenderer } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const [width = 0, height = 0, x = 0, y = 0] = location.hash.slice(1).split(",").map(Number);
const renderer = new WebGLRenderer({ antialias: true });
renderer.setSize(width, height);
document.body.style.margin = "0";
document.body.append(renderer.domElement);
const [scene, camera] = [new Scene(), new PerspectiveCamera(55, width / height, 0.1, 200)];
camera.up.set(0, 0, 1);
renderer.setAnimationLoop((now) => {
  const at = x + Math.sin(now / 1000);
  camera.position.set(at + 3.5, y, 2.5);
  camera.lookAt(at - 1, y, 0.3);
  renderer.render(scene, camera);
});
new GLTFLoader().load("/map.glb", ({ scene: building }) => {
  building.traverse((part) => {
    if (part instanceof Mesh) {
      const { map = null } = part.material as MeshBasicMaterial;
      part.material = new MeshBasicMaterial({ map, vertexColors: part.geometry.hasAttribute("color") });
    }
  });
  // glTF's y is up; the map's z is.
  building.rotation.x = Math.PI / 2;
  scene.add(building);
  performance.mark("farsteer: robot seen");
});
