// The part of ROS# 2.2 that examples/unity uses, built for ROS 2: its signatures, and a client that is its stand-in on the
// wire. Facts from github.com/siemens/ros-sharp, com.siemens.ros-sharp/Runtime: the members and their order in
// Communication.cs, ids and dispatch in RosSocket.cs, binary frames of a kilobyte and ASCII in WebSocketNetProtocol.cs and
// NewtonsoftJsonSerializer.cs, fields and names of messages in MessageTypes/ROS2, threads in RosCommunication/.
// As there, Json.NET makes and reads the JSON, here Debian's version of it.

using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Net.WebSockets;
using System.Text;
using System.Threading;
using Newtonsoft.Json;
using Newtonsoft.Json.Linq;
using UnityEngine;

namespace RosSharp.RosBridgeClient
{
    public abstract class Message { }

    public delegate void SubscriptionHandler<T>(T t) where T : Message;
    public delegate void ServiceResponseHandler<T>(T t) where T : Message;

    internal abstract class Communication
    {
        public string op { get; set; }
        public string id { get; set; }
    }

    internal sealed class Advertisement : Communication
    {
        public string topic { get; set; }
        public string type { get; set; }
    }

    internal sealed class Publication : Communication
    {
        public string topic { get; set; }
        public Message msg { get; set; }
    }

    internal sealed class Subscription : Communication
    {
        public string topic { get; set; }
        public string type { get; set; }
        public int throttle_rate { get; set; }
        public int queue_length { get; set; }
        public int fragment_size { get; set; }
        public string compression { get; set; }
    }

    internal sealed class ServiceCall : Communication
    {
        public string service { get; set; }
        public Message args { get; set; }
        public int fragment_size { get; set; }
        public string compression { get; set; }
    }

    public sealed class RosSocket
    {
        public enum SerializerEnum { Microsoft, Newtonsoft_JSON }

        private const int Chunk = 1024;
        private readonly ClientWebSocket socket = new ClientWebSocket();
        private readonly Dictionary<string, Action<JToken>> subscribers = new Dictionary<string, Action<JToken>>();
        private readonly Dictionary<string, Action<JToken>> consumers = new Dictionary<string, Action<JToken>>();
        private readonly object sending = new object();

        private readonly ManualResetEvent connected = new ManualResetEvent(false);

        // What is sent before waits, as there.
        internal void Connect(string url)
        {
            socket.ConnectAsync(new Uri(url), CancellationToken.None).Wait();
            connected.Set();
            new Thread(Listen) { IsBackground = true }.Start();
        }

        internal bool IsOpen { get { return socket.State == WebSocketState.Open; } }

        public string Advertise<T>(string topic) where T : Message
        {
            Send(new Advertisement { op = "advertise", id = topic, topic = topic, type = NameOf<T>() });
            return topic;
        }

        public void Publish(string id, Message message)
        {
            Send(new Publication { op = "publish", id = id, topic = id, msg = message });
        }

        public string Subscribe<T>(string topic, SubscriptionHandler<T> subscriptionHandler, int throttle_rate = 0,
            int queue_length = 1, int fragment_size = int.MaxValue, string compression = "none",
            bool ensureThreadSafety = false) where T : Message
        {
            lock (subscribers)
            {
                string id = Unused(subscribers, topic);
                subscribers[id] = message => subscriptionHandler(message.ToObject<T>());
                Send(new Subscription
                {
                    op = "subscribe", id = id, topic = topic, type = NameOf<T>(), throttle_rate = throttle_rate,
                    queue_length = queue_length, fragment_size = fragment_size, compression = compression,
                });
                return id;
            }
        }

        public string CallService<Tin, Tout>(string service, ServiceResponseHandler<Tout> serviceResponseHandler,
            Tin serviceArguments) where Tin : Message where Tout : Message
        {
            string id = Unused(consumers, service);
            consumers[id] = values => serviceResponseHandler(values.ToObject<Tout>());
            Send(new ServiceCall
            {
                op = "call_service", id = id, service = service, args = serviceArguments,
                fragment_size = int.MaxValue, compression = "none",
            });
            return id;
        }

        public void Close(int millisecondsWait = 0)
        {
            socket.CloseOutputAsync(WebSocketCloseStatus.NormalClosure, "", CancellationToken.None).Wait();
        }

        private void Send(Communication communication)
        {
            byte[] data = Encoding.ASCII.GetBytes(JsonConvert.SerializeObject(communication));
            connected.WaitOne();
            lock (sending)
                for (int at = 0; at < data.Length; at += Chunk)
                {
                    int count = Math.Min(Chunk, data.Length - at);
                    ArraySegment<byte> part = new ArraySegment<byte>(data, at, count);
                    bool last = at + count == data.Length;
                    socket.SendAsync(part, WebSocketMessageType.Binary, last, CancellationToken.None).Wait();
                }
        }

        // What ROS# would write to the console here ends the program: a message that it cannot read is a failure.
        private void Listen()
        {
            byte[] buffer = new byte[Chunk];
            while (socket.State == WebSocketState.Open)
            {
                MemoryStream frame = new MemoryStream();
                WebSocketReceiveResult part;
                do
                {
                    part = socket.ReceiveAsync(new ArraySegment<byte>(buffer), CancellationToken.None).Result;
                    if (part.MessageType == WebSocketMessageType.Close)
                        return;
                    frame.Write(buffer, 0, part.Count);
                } while (!part.EndOfMessage);
                Receive(JObject.Parse(Encoding.ASCII.GetString(frame.ToArray())));
            }
        }

        private void Receive(JObject operation)
        {
            switch ((string)operation["op"])
            {
                case "publish":
                    List<Action<JToken>> found;
                    lock (subscribers)
                        found = subscribers.Where(pair => pair.Key.StartsWith(operation["topic"] + ":"))
                            .Select(pair => pair.Value).ToList();
                    found.ForEach(take => take(operation["msg"]));
                    return;
                case "service_response":
                    consumers[(string)operation["id"]](operation["values"]);
                    return;
                case "status": // ROS# ignores it; here it says what the server did not take.
                    Console.WriteLine("status: " + operation["msg"]);
                    return;
            }
        }

        private static string NameOf<T>()
        {
            return (string)typeof(T).GetField("RosMessageName").GetRawConstantValue();
        }

        private static string Unused(Dictionary<string, Action<JToken>> ids, string name)
        {
            int counter = 0;
            while (ids.ContainsKey(name + ":" + counter))
                counter++;
            return name + ":" + counter;
        }
    }

    public class RosConnector : MonoBehaviour
    {
        public static string Url; // Unity's inspector sets the field below
        public int SecondsTimeout = 10;
        public RosSocket.SerializerEnum Serializer;
        public string RosBridgeServerUrl = Url ?? "ws://localhost:9090";

        public RosSocket RosSocket { get; private set; }
        public ManualResetEvent IsConnected { get; private set; }

        public virtual void Awake()
        {
            IsConnected = new ManualResetEvent(false);
            if (Url == null) // a test without a robot
                return;
            RosSocket = new RosSocket();
            new Thread(() =>
            {
                RosSocket.Connect(RosBridgeServerUrl);
                IsConnected.Set();
            }) { IsBackground = true }.Start();
        }
    }

    [RequireComponent(typeof(RosConnector))]
    public abstract class UnityPublisher<T> : MonoBehaviour where T : Message
    {
        public string Topic;
        private string publicationId;

        protected virtual void Start()
        {
            publicationId = GetComponent<RosConnector>().RosSocket.Advertise<T>(Topic);
        }

        protected void Publish(T message)
        {
            GetComponent<RosConnector>().RosSocket.Publish(publicationId, message);
        }
    }

    [RequireComponent(typeof(RosConnector))]
    public abstract class UnitySubscriber<T> : MonoBehaviour where T : Message
    {
        public string Topic;
        public float TimeStep;
        public bool EnsureThreadSafety = false;

        protected virtual void Start()
        {
            RosConnector connector = GetComponent<RosConnector>();
            new Thread(() =>
            {
                connector.IsConnected.WaitOne(1000);
                connector.RosSocket.Subscribe<T>(Topic, ReceiveMessage, (int)(TimeStep * 1000));
            }) { IsBackground = true }.Start();
        }

        protected abstract void ReceiveMessage(T message);
    }

    public static class HeaderExtensions
    {
        public static void Update(this MessageTypes.Std.Header header)
        {
            TimeSpan now = DateTime.UtcNow - new DateTime(1970, 1, 1, 0, 0, 0, DateTimeKind.Utc);
            header.stamp.sec = (int)now.TotalSeconds;
            header.stamp.nanosec = (uint)((now.TotalSeconds - Math.Floor(now.TotalSeconds)) * 1e9);
        }
    }
}

namespace RosSharp.RosBridgeClient.MessageTypes.BuiltinInterfaces
{
    public class Time : Message
    {
        public int sec { get; set; }
        public uint nanosec { get; set; }
    }
}

namespace RosSharp.RosBridgeClient.MessageTypes.Std
{
    public class Header : Message
    {
        public BuiltinInterfaces.Time stamp { get; set; } = new BuiltinInterfaces.Time();
        public string frame_id { get; set; } = "";
    }

    public class Time : Message { } // as there, with a name of Unity's

    public class String : Message
    {
        public const string RosMessageName = "std_msgs/msg/String";
        public string data { get; set; } = "";
    }

    public class TriggerRequest : Message
    {
        public const string RosMessageName = "std_srvs/srv/Trigger";
    }

    public class TriggerResponse : Message
    {
        public const string RosMessageName = "std_srvs/srv/Trigger";
        public bool success { get; set; }
        public string message { get; set; } = "";
    }
}

namespace RosSharp.RosBridgeClient.MessageTypes.Geometry
{
    public class Point : Message
    {
        public double x { get; set; }
        public double y { get; set; }
        public double z { get; set; }
    }

    public class Quaternion : Message
    {
        public double x { get; set; }
        public double y { get; set; }
        public double z { get; set; }
        public double w { get; set; }
    }

    public class Vector3 : Message { } // as there, these two have names of Unity's

    public class Transform : Message { }

    public class Pose : Message
    {
        public Point position { get; set; } = new Point();
        public Quaternion orientation { get; set; } = new Quaternion();
    }

    public class PoseWithCovariance : Message
    {
        public Pose pose { get; set; } = new Pose();
        public double[] covariance { get; set; } = new double[36];
    }

    public class PoseWithCovarianceStamped : Message
    {
        public const string RosMessageName = "geometry_msgs/msg/PoseWithCovarianceStamped";
        public Std.Header header { get; set; } = new Std.Header();
        public PoseWithCovariance pose { get; set; } = new PoseWithCovariance();
    }
}

namespace RosSharp.RosBridgeClient.MessageTypes.Sensor
{
    public class PointCloud : Message { } // as there, with a name of ours

    public class Joy : Message
    {
        public const string RosMessageName = "sensor_msgs/msg/Joy";
        public Std.Header header { get; set; } = new Std.Header();
        public float[] axes { get; set; } = new float[0];
        public int[] buttons { get; set; } = new int[0];
    }

    public class JointState : Message
    {
        public const string RosMessageName = "sensor_msgs/msg/JointState";
        public Std.Header header { get; set; } = new Std.Header();
        public string[] name { get; set; } = new string[0];
        public double[] position { get; set; } = new double[0];
        public double[] velocity { get; set; } = new double[0];
        public double[] effort { get; set; } = new double[0];
    }

    public class PointField : Message
    {
        public string name { get; set; } = "";
        public uint offset { get; set; }
        public byte datatype { get; set; }
        public uint count { get; set; }
    }

    public class PointCloud2 : Message
    {
        public const string RosMessageName = "sensor_msgs/msg/PointCloud2";
        public Std.Header header { get; set; } = new Std.Header();
        public uint height { get; set; }
        public uint width { get; set; }
        public PointField[] fields { get; set; } = new PointField[0];
        public bool is_bigendian { get; set; }
        public uint point_step { get; set; }
        public uint row_step { get; set; }
        public byte[] data { get; set; } = new byte[0];
        public bool is_dense { get; set; }
    }
}
