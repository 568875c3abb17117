using System;
using System.Collections.Generic;
using System.Text;
using RosSharp.RosBridgeClient.MessageTypes.Sensor;
using UnityEngine;

namespace Farsteer
{
    /// <summary>Points in Unity's axes, with one value each: their distance to the map, if that is known.</summary>
    public sealed class PointCloud
    {
        private const byte Float32 = 7; // FLOAT32 of sensor_msgs/PointField

        public readonly Vector3[] Points;

        /// <summary>Distance to the map [m], negative behind its surfaces; NaN where nothing is mapped nearby.</summary>
        public readonly float[] Distances;

        private PointCloud(byte[] data, int start, int step, int count, Dictionary<string, int> offsets)
        {
            int x = Offset(offsets, "x"), y = Offset(offsets, "y"), z = Offset(offsets, "z");
            int distance = offsets.ContainsKey("distance") ? offsets["distance"] : -1;
            if ((long)start + (long)step * count > data.Length)
                throw new FormatException("the cloud must have " + count + " points of " + step + " bytes, and ends early");
            Points = new Vector3[count];
            Distances = new float[count];
            for (int i = 0, at = start; i < count; i++, at += step)
            {
                Points[i] = RosFrames.Point(Single(data, at + x), Single(data, at + y), Single(data, at + z));
                Distances[i] = distance < 0 ? float.NaN : Single(data, at + distance);
            }
        }

        /// <summary>Reads a message such as those of /local_cloud: little-endian, its fields float32.</summary>
        public static PointCloud Read(PointCloud2 message)
        {
            Dictionary<string, int> offsets = new Dictionary<string, int>();
            foreach (PointField field in message.fields)
                if (field.datatype == Float32)
                    offsets[field.name] = (int)field.offset;
            int count = (int)(message.width * message.height);
            return new PointCloud(message.data, 0, (int)message.point_step, count, offsets);
        }

        /// <summary>Reads a binary little-endian PLY file whose properties are floats, such as /map.ply.</summary>
        public static PointCloud ReadPly(byte[] file)
        {
            Dictionary<string, int> offsets = new Dictionary<string, int>();
            int at = 0, count = -1, step = 0;
            bool binary = false;
            for (string line = Line(file, ref at); line != "end_header"; line = Line(file, ref at))
            {
                string[] words = line.Split(' ');
                if (line == "format binary_little_endian 1.0")
                    binary = true;
                else if (line.StartsWith("element vertex "))
                    count = int.Parse(words[2]);
                else if (line.StartsWith("element ") || line.StartsWith("property ") && words[1] != "float")
                    throw new FormatException("the PLY file must hold vertices of floats alone, not \"" + line + "\"");
                else if (line.StartsWith("property "))
                {
                    offsets[words[2]] = step;
                    step += 4;
                }
            }
            if (!binary || count < 0)
                throw new FormatException("the PLY file must be binary_little_endian 1.0, with an element vertex");
            return new PointCloud(file, at, step, count, offsets);
        }

        private static string Line(byte[] file, ref int at)
        {
            int end = Array.IndexOf(file, (byte)'\n', at);
            if (end < 0)
                throw new FormatException("the PLY file must have a line end_header");
            string line = Encoding.ASCII.GetString(file, at, end - at).TrimEnd('\r');
            at = end + 1;
            return line;
        }

        private static int Offset(Dictionary<string, int> offsets, string name)
        {
            if (!offsets.ContainsKey(name))
                throw new FormatException("the cloud must have a field " + name + " of float32");
            return offsets[name];
        }

        private static float Single(byte[] data, int at)
        {
            return BitConverter.ToSingle(data, at); // All processors that Unity runs on are little-endian.
        }
    }
}
