// Runs examples/unity without Unity: conversions and joints as numbers, and the paper's sequence against a robot.

using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Threading;
using Farsteer;
using RosSharp.RosBridgeClient;
using UnityEngine;
using Std = RosSharp.RosBridgeClient.MessageTypes.Std;
using Geometry = RosSharp.RosBridgeClient.MessageTypes.Geometry;

public static class Play
{
    private const float Frame = 0.02f;
    private static GameObject robot;

    public static int Main(string[] words)
    {
        CultureInfo.CurrentCulture = CultureInfo.InvariantCulture;
        switch (words[0])
        {
            case "numbers":
                foreach (string line in Lines(Console.In))
                    Print(Converted(line.Split(' ')));
                return 0;
            case "cloud":
                Vector3[] points = PointCloud.ReadPly(File.ReadAllBytes(words[1])).Points;
                for (int i = 0; i < points.Length; i += 100)
                    Print(Numbers(points[i]));
                return 0;
            case "model":
                Model(words.Skip(1).ToArray(), Console.In.ReadToEnd());
                return 0;
            case "show":
                return Show(double.Parse(words[1]));
            default:
                return Sequence(words.Skip(1).Select(double.Parse).ToArray());
        }
    }

    private static IEnumerable<string> Lines(TextReader reader)
    {
        for (string line = reader.ReadLine(); line != null; line = reader.ReadLine())
            yield return line;
    }

    private static void Print(double[] numbers)
    {
        Console.WriteLine(string.Join(" ", numbers.Select(x => x.ToString("R"))));
    }

    private static double[] Converted(string[] words)
    {
        double[] n = words.Skip(1).Select(double.Parse).ToArray();
        switch (words[0])
        {
            case "point":
                return Numbers(RosFrames.Point(n[0], n[1], n[2]));
            case "size":
                return Numbers(RosFrames.Size(n[0], n[1], n[2]));
            case "rotation":
                return Numbers(RosFrames.Rotation(n[0], n[1], n[2], n[3]));
            case "turn":
                return Numbers(RosFrames.Turn(n[0], n[1], n[2], n[3]));
            case "rpy":
                return Numbers(RosFrames.RollPitchYaw(n[0], n[1], n[2]));
            case "towards":
                return Numbers(RosFrames.Towards(new Vector3((float)n[0], (float)n[1], (float)n[2])));
            case "ros":
                Vector3 position = new Vector3((float)n[0], (float)n[1], (float)n[2]);
                Geometry.Pose pose = RosFrames.ToRos(
                    position, new Quaternion((float)n[3], (float)n[4], (float)n[5], (float)n[6]));
                return new[]
                {
                    pose.position.x, pose.position.y, pose.position.z,
                    pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w,
                };
            default:
                throw new ArgumentException("no such conversion: " + words[0]);
        }
    }

    private static double[] Numbers(Vector3 v)
    {
        return new double[] { v.x, v.y, v.z };
    }

    private static double[] Numbers(Quaternion q)
    {
        return new double[] { q.x, q.y, q.z, q.w };
    }

    private static void Begin()
    {
        RosConnector.Url = Environment.GetEnvironmentVariable("FARSTEER_URL");
        Application.isFocused = true;
        robot = new GameObject("robot");
        robot.AddComponent<FarsteerRobot>();
    }

    /// <summary>Goes on for a time [s], or until something has happened; says whether it has.</summary>
    private static bool Run(double seconds, Func<bool> happened = null)
    {
        Stopwatch watch = Stopwatch.StartNew();
        while (watch.Elapsed.TotalSeconds < seconds)
        {
            Frames.Next(Frame);
            if (happened != null && happened())
                return true;
            Thread.Sleep((int)(1000 * Frame));
        }
        return false;
    }

    /// <summary>Builds a URDF without a robot, and moves its joints: name, position, name, position...</summary>
    private static void Model(string[] joints, string urdf)
    {
        RobotModel model = new GameObject("robot").AddComponent<RobotModel>();
        MethodInfo receive = typeof(RobotModel).GetMethod("ReceiveMessage", BindingFlags.Instance | BindingFlags.NonPublic);
        receive.Invoke(model, new object[] { new Std.String { data = urdf } });
        Frames.Send(model, "Update");
        for (int i = 0; i < joints.Length; i += 2)
            model.Set(joints[i], double.Parse(joints[i + 1]));
        PrintObjects();
    }

    /// <summary>Shows the robot for a time, turns it to the right, and presses the e-stop as it turns.</summary>
    private static int Show(double seconds)
    {
        Begin();
        Run(seconds);
        Stick(0, true);
        Run(0.4);
        Input.Axes["Horizontal"] = 1;
        Run(1);
        Input.Down.Add(KeyCode.Space);
        Run(1.5);
        PrintObjects();
        return 0;
    }

    /// <summary>Prints the name, position, rotation and scale of each object, and how many points its mesh has.</summary>
    private static void PrintObjects()
    {
        foreach (GameObject part in GameObject.All)
        {
            MeshFilter filter = part.GetComponent<MeshFilter>();
            IEnumerable<double> numbers = Numbers(part.transform.position).Concat(Numbers(part.transform.rotation))
                .Concat(Numbers(part.transform.localScale)).Concat(new double[] { filter == null ? 0 : filter.sharedMesh.Shown });
            Console.WriteLine("object:" + part.name + ":" + string.Join(" ", numbers.Select(x => x.ToString("R"))));
        }
    }

    /// <summary>The paper's sequence; given is where the operator sees the robot: x, y [m], heading [rad].</summary>
    private static int Sequence(double[] place)
    {
        Begin();
        MapCloud map = robot.GetComponent<MapCloud>();
        LocalCloud local = robot.GetComponent<LocalCloud>();
        if (!Run(10, () => map.Cloud != null && local.Cloud != null))
            return Fail("no clouds within 10 s");
        Console.WriteLine("map of " + map.Cloud.Points.Length + " points, discrepancy " + local.Discrepancy);

        Stick(0, true);
        Run(0.4);
        Stick(1, true);
        bool wrong = Run(12, () => local.Discrepancy > 0.5);
        Stick(0, false);
        if (!wrong)
            return Fail("no errors within 12 s");
        Console.WriteLine("errors: discrepancy " + local.Discrepancy);
        Run(1.5);

        Vector3 at = RosFrames.Point(place[0], place[1], 0);
        Mouse(Input.Pressed, at);
        Mouse(Input.Released, at + RosFrames.Point(Math.Cos(place[2]), Math.Sin(place[2]), 0));
        if (!Run(5, () => local.Discrepancy < 0.1))
            return Fail("the hint has not helped within 5 s");
        Console.WriteLine("corrected: discrepancy " + local.Discrepancy);

        Stick(0, true);
        Run(0.4);
        Stick(1, true);
        Run(3);
        Stick(0, false);
        RosSocket socket = robot.GetComponent<RosConnector>().RosSocket;
        Run(60, () => !socket.IsOpen);
        return 0;
    }

    private static int Fail(string reason)
    {
        Console.WriteLine("error: " + reason);
        return 1;
    }

    private static void Mouse(HashSet<int> happens, Vector3 over)
    {
        happens.Add(1);
        Input.mousePosition = new Vector3(over.x, over.z, 0);
        Frames.Next(Frame);
    }

    private static void Stick(float forward, bool held)
    {
        Input.Axes["Vertical"] = forward;
        if (held)
            Input.Held.Add(KeyCode.LeftShift);
        else
            Input.Held.Remove(KeyCode.LeftShift);
    }
}
