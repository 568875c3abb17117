using RosSharp.RosBridgeClient;
using RosSharp.RosBridgeClient.MessageTypes.Sensor;
using UnityEngine;

namespace Farsteer
{
    /// <summary>Moves the arm of the robot's model as that of the robot is.</summary>
    [RequireComponent(typeof(RobotModel))]
    public sealed class RobotJoints : MonoBehaviour
    {
        private volatile JointState received;

        private void Start()
        {
            // Arm and wheels have a message each; UnitySubscriber asks for the newest alone, that of the wheels.
            RosSocket socket = GetComponent<RosConnector>().Connected();
            socket.Subscribe<JointState>("/joint_states", ReceiveMessage, queue_length: 2);
        }

        // ROS# calls this in a thread of its own, where nothing of the scene may be touched.
        private void ReceiveMessage(JointState message)
        {
            if (message.position.Length == message.name.Length) // Wheels have rates alone.
                received = message;
        }

        private void Update()
        {
            JointState message = received;
            if (message == null)
                return;
            for (int i = 0; i < message.name.Length; i++)
                GetComponent<RobotModel>().Set(message.name[i], message.position[i]);
        }
    }
}
