using RosSharp.RosBridgeClient;
using RosSharp.RosBridgeClient.MessageTypes.Geometry;
using UnityEngine;

namespace Farsteer
{
    /// <summary>Moves the robot's model to where the robot believes itself to be in the map, ten times a second.</summary>
    [RequireComponent(typeof(RobotModel))]
    public sealed class RobotPose : UnitySubscriber<PoseWithCovarianceStamped>
    {
        private volatile PoseWithCovarianceStamped received;

        protected override void Start()
        {
            Topic = "/amcl_pose";
            base.Start();
        }

        // ROS# calls this in a thread of its own, where nothing of the scene may be touched.
        protected override void ReceiveMessage(PoseWithCovarianceStamped message)
        {
            received = message;
        }

        private void Update()
        {
            PoseWithCovarianceStamped message = received;
            UnityEngine.Transform robot = GetComponent<RobotModel>().Base;
            if (message == null || robot == null)
                return;
            robot.localPosition = RosFrames.Point(message.pose.pose.position);
            robot.localRotation = RosFrames.Rotation(message.pose.pose.orientation);
        }
    }
}
