using RosSharp.RosBridgeClient;
using UnityEngine;

namespace Farsteer
{
    /// <summary>All of it: added to an empty object, whose axes are then those of the map.</summary>
    [RequireComponent(typeof(RosConnector))]
    [RequireComponent(typeof(MapCloud), typeof(LocalCloud))]
    [RequireComponent(typeof(RobotModel), typeof(RobotPose), typeof(RobotJoints))]
    [RequireComponent(typeof(JoyDriver), typeof(PoseHint))]
    public sealed class FarsteerRobot : MonoBehaviour
    {
        /// <summary>Of the points: one whose shader shows colours of vertices, such as Particles/Standard Unlit.</summary>
        public Material Points;

        private void Awake()
        {
            GetComponent<MapCloud>().Material = Points;
            GetComponent<LocalCloud>().Material = Points;
        }
    }
}
