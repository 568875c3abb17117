using RosSharp.RosBridgeClient;
using RosSharp.RosBridgeClient.MessageTypes.Geometry;
using RosSharp.RosBridgeClient.MessageTypes.Std;

namespace Farsteer
{
    // The robot's own types, with the fields that the scripts read; ROS# ignores the others.

    /// <summary>Which cloud the robot localises in.</summary>
    public sealed class MapInfo : Message
    {
        public const string RosMessageName = "farsteer_msgs/msg/MapInfo";

        public string name { get; set; }

        /// <summary>Hash of the file's bytes, in lower-case hexadecimal digits.</summary>
        public string sha256 { get; set; }
    }

    /// <summary>What became of a hint.</summary>
    public sealed class HintVerdict : Message
    {
        public const string RosMessageName = "farsteer_msgs/msg/HintVerdict";

        public Header header { get; set; }

        /// <summary>accepted, kept, ambiguous or rejected.</summary>
        public string verdict { get; set; }

        public string reason { get; set; }
        public Pose hint { get; set; }
    }
}
