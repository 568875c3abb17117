using UnityEngine;
using UnityEngine.Rendering;

namespace Farsteer
{
    /// <summary>A child object whose mesh is a cloud of points, one pixel each.</summary>
    public sealed class PointMesh
    {
        public readonly Mesh Mesh = new Mesh { indexFormat = IndexFormat.UInt32 };

        public PointMesh(Transform parent, string name, Material material)
        {
            GameObject child = new GameObject(name);
            child.transform.SetParent(parent, false);
            child.AddComponent<MeshFilter>().sharedMesh = Mesh;
            child.AddComponent<MeshRenderer>().sharedMaterial = material;
        }

        /// <summary>Shows these points, and no others any more.</summary>
        public void Show(Vector3[] points, Color32[] colours)
        {
            int[] indices = new int[points.Length];
            for (int i = 0; i < indices.Length; i++)
                indices[i] = i;
            Mesh.Clear();
            Mesh.vertices = points;
            Mesh.colors32 = colours;
            Mesh.SetIndices(indices, MeshTopology.Points, 0);
        }
    }
}
