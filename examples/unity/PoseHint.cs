using RosSharp.RosBridgeClient;
using RosSharp.RosBridgeClient.MessageTypes.Geometry;
using UnityEngine;

namespace Farsteer
{
    /// <summary>
    /// Tells the robot where it is: press the right mouse button where it stands on the ground, drag to where it looks,
    /// let go. The robot answers with a verdict.
    /// </summary>
    public sealed class PoseHint : UnityPublisher<PoseWithCovarianceStamped>
    {
        /// <summary>Shortest way of the mouse that says a heading [m]; chosen: the robot is 0.5 m long.</summary>
        public float LeastDrag = 0.1f;

        private UnityEngine.Vector3? pressed;

        protected override void Start()
        {
            Topic = "/initialpose";
            RosSocket socket = GetComponent<RosConnector>().Connected();
            base.Start();
            socket.Subscribe<HintVerdict>(
                "/localization/hint_verdict", answer => Debug.Log("hint " + answer.verdict + ": " + answer.reason));
        }

        private void Update()
        {
            if (Input.GetMouseButtonDown(1))
                pressed = Ground();
            if (!Input.GetMouseButtonUp(1) || pressed == null)
                return;
            UnityEngine.Vector3 at = pressed.Value, to = Ground() ?? at;
            pressed = null;
            if ((to - at).magnitude >= LeastDrag)
                Give(at, to - at);
        }

        private void Give(UnityEngine.Vector3 at, UnityEngine.Vector3 ahead)
        {
            PoseWithCovarianceStamped hint = new PoseWithCovarianceStamped();
            hint.header.Update();
            hint.header.frame_id = "map";
            hint.pose.pose = RosFrames.ToRos(at, RosFrames.Towards(ahead));
            Publish(hint); // A covariance of zeros selects the default, 0.5 m and 15 degrees.
        }

        /// <summary>What the mouse points at on the ground, in the map's axes as Unity has them; null above the horizon.</summary>
        private UnityEngine.Vector3? Ground()
        {
            Ray ray = Camera.main.ScreenPointToRay(Input.mousePosition);
            float distance;
            if (!new Plane(transform.up, transform.position).Raycast(ray, out distance))
                return null;
            return transform.InverseTransformPoint(ray.GetPoint(distance));
        }
    }
}
