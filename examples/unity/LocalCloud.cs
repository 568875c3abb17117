using RosSharp.RosBridgeClient;
using RosSharp.RosBridgeClient.MessageTypes.Sensor;
using UnityEngine;

namespace Farsteer
{
    /// <summary>
    /// Shows the robot's last sweep within the map: green where it agrees with the map, red where it does not, blue where
    /// nothing is mapped nearby. A pose that is wrong shows as red and blue walls beside those of the map.
    /// </summary>
    public sealed class LocalCloud : UnitySubscriber<PointCloud2>
    {
        public Material Material;

        /// <summary>Distance to the map at which a point is all red [m]; chosen.</summary>
        public float Red = 0.3f;

        /// <summary>The sweep that is shown; null until one has come.</summary>
        public PointCloud Cloud { get; private set; }

        /// <summary>Share of this sweep that is all red or blue, 0 to 1.</summary>
        public float Discrepancy { get; private set; }

        private volatile PointCloud received;
        private PointMesh mesh;

        protected override void Start()
        {
            Topic = "/local_cloud";
            base.Start();
        }

        // ROS# calls this in a thread of its own, where nothing of the scene may be touched.
        protected override void ReceiveMessage(PointCloud2 message)
        {
            received = PointCloud.Read(message);
        }

        private void Update()
        {
            PointCloud cloud = received;
            if (cloud == null || cloud == Cloud)
                return;
            Cloud = cloud;
            Color32[] colours = new Color32[cloud.Points.Length];
            int agreeing = 0;
            for (int i = 0; i < colours.Length; i++)
            {
                colours[i] = Colour(cloud.Distances[i] / Red);
                agreeing += Mathf.Abs(cloud.Distances[i]) < Red ? 1 : 0;
            }
            Discrepancy = colours.Length == 0 ? 0 : 1 - (float)agreeing / colours.Length;
            if (mesh == null)
                mesh = new PointMesh(transform, "local cloud", Material);
            mesh.Show(cloud.Points, colours);
        }

        private static Color32 Colour(float share)
        {
            if (float.IsNaN(share))
                return new Color32(60, 110, 255, 255);
            byte red = (byte)(255 * Mathf.Clamp(Mathf.Abs(share), 0, 1));
            return new Color32(red, (byte)(255 - red), 40, 255);
        }
    }
}
