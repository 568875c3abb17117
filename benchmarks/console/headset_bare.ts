/** The bare drawing library in a headset: the same points, drawn by three's own material, and nothing else. */

import { PerspectiveCamera, Points, PointsMaterial, Scene, WebGLRenderer } from "three";
import { PLYLoader } from "three/addons/loaders/PLYLoader.js";

declare global {
  interface Window {
    bareTimes: number[];
    enterBare: () => Promise<void>;
  }
}

const renderer = new WebGLRenderer();
const [scene, camera] = [new Scene(), new PerspectiveCamera()];
scene.rotation.x = -Math.PI / 2;
document.body.append(renderer.domElement);
renderer.xr.enabled = true;
renderer.setAnimationLoop(() => {
  const before = performance.now();
  renderer.render(scene, camera);
  if (renderer.xr.isPresenting) {
    window.bareTimes.push(performance.now() - before);
  }
});
window.bareTimes = [];
window.enterBare = async () => {
  const session = await navigator.xr?.requestSession("immersive-vr", { requiredFeatures: ["local-floor"] });
  await renderer.xr.setSession(session ?? null);
};
new PLYLoader().load("/map.ply", (geometry) => {
  scene.add(new Points(geometry, new PointsMaterial({ size: 0.062 })));
  performance.mark("farsteer: robot seen");
});
