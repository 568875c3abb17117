using RosSharp.RosBridgeClient;

namespace Farsteer
{
    public static class Connection
    {
        /// <summary>The socket, once it is connected or the time for that is over: ROS# connects in a thread.</summary>
        public static RosSocket Connected(this RosConnector connector)
        {
            connector.IsConnected.WaitOne(connector.SecondsTimeout * 1000);
            return connector.RosSocket;
        }
    }
}
