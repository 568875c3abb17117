using RosSharp.RosBridgeClient;
using RosSharp.RosBridgeClient.MessageTypes.Sensor;
using RosSharp.RosBridgeClient.MessageTypes.Std;
using UnityEngine;

namespace Farsteer
{
    /// <summary>
    /// Drives by gamepad or keys while the deadman is held: press it, then the stick. Space or B stops the robot for good,
    /// R releases that. Without focus, and while the game is paused, nothing is held, and the robot brakes.
    /// </summary>
    public sealed class JoyDriver : UnityPublisher<Joy>
    {
        /// <summary>Time between two messages [s]: ten of them fit into the 0.5 s after which the robot brakes.</summary>
        public float Period = 0.05f;

        /// <summary>Time for which it says that the deadman is released [s]; then it is silent, and others may drive.</summary>
        public float Farewell = 0.5f;

        private float due;
        private float lastHeld = float.NegativeInfinity;

        protected override void Start()
        {
            Topic = "/joy";
            GetComponent<RosConnector>().Connected();
            base.Start();
        }

        private void Update()
        {
            if (Input.GetKeyDown(KeyCode.Space) || Input.GetKeyDown(KeyCode.JoystickButton1))
                Call("/teleop/estop");
            if (Input.GetKeyDown(KeyCode.R))
                Call("/teleop/estop_reset");
            bool held = Application.isFocused && (Input.GetKey(KeyCode.LeftShift) || Input.GetKey(KeyCode.JoystickButton4));
            if (held)
                lastHeld = UnityEngine.Time.unscaledTime;
            if (UnityEngine.Time.unscaledTime < due || UnityEngine.Time.unscaledTime - lastHeld > Farewell)
                return;
            due = UnityEngine.Time.unscaledTime + Period;
            bool turbo = Input.GetKey(KeyCode.LeftControl) || Input.GetKey(KeyCode.JoystickButton5);
            Joy joy = new Joy();
            joy.header.Update();
            joy.header.frame_id = "Unity";
            // Left is positive in ROS, and right in Unity.
            joy.axes = new[] { -Input.GetAxis("Horizontal"), Input.GetAxis("Vertical") };
            joy.buttons = new[] { 0, 0, 0, 0, held ? 1 : 0, turbo ? 1 : 0 };
            Publish(joy);
        }

        private void Call(string service)
        {
            GetComponent<RosConnector>().RosSocket.CallService<TriggerRequest, TriggerResponse>(
                service,
                answer => Debug.Log(service + ": " + answer.message),
                new TriggerRequest());
        }
    }
}
