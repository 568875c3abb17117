using System;
using UnityEngine;
using Geometry = RosSharp.RosBridgeClient.MessageTypes.Geometry;

namespace Farsteer
{
    /// <summary>
    /// Conversions between ROS (REP 103: right-handed, x ahead, y left, z up) and Unity (left-handed, x right, y up,
    /// z ahead), both in metres. A point (x, y, z) of ROS is (-y, z, x) in Unity. That is a reflection, so the axis of a
    /// rotation also changes its sign; products of rotations stay products.
    /// </summary>
    public static class RosFrames
    {
        /// <summary>A point or direction of ROS [m], in Unity.</summary>
        public static Vector3 Point(double x, double y, double z)
        {
            return new Vector3((float)-y, (float)z, (float)x);
        }

        public static Vector3 Point(Geometry.Point point)
        {
            return Point(point.x, point.y, point.z);
        }

        /// <summary>The edges of a box along the axes of ROS [m], in Unity.</summary>
        public static Vector3 Size(double x, double y, double z)
        {
            return new Vector3((float)y, (float)z, (float)x);
        }

        /// <summary>A unit quaternion of ROS, in Unity.</summary>
        public static Quaternion Rotation(double x, double y, double z, double w)
        {
            return new Quaternion((float)y, (float)-z, (float)-x, (float)w);
        }

        public static Quaternion Rotation(Geometry.Quaternion rotation)
        {
            return Rotation(rotation.x, rotation.y, rotation.z, rotation.w);
        }

        /// <summary>The rotation by an angle [rad] about a unit axis of ROS, by the right-hand rule, in Unity.</summary>
        public static Quaternion Turn(double x, double y, double z, double angle)
        {
            double half = Math.Sin(angle / 2);
            return Rotation(x * half, y * half, z * half, Math.Cos(angle / 2));
        }

        /// <summary>The rotation of a URDF's rpy: about the fixed axes x, then y, then z of ROS [rad], in Unity.</summary>
        public static Quaternion RollPitchYaw(double roll, double pitch, double yaw)
        {
            return Turn(0, 0, 1, yaw) * Turn(0, 1, 0, pitch) * Turn(1, 0, 0, roll);
        }

        /// <summary>The heading of a robot that looks along a direction on Unity's ground.</summary>
        public static Quaternion Towards(Vector3 ahead)
        {
            return Turn(0, 0, 1, Math.Atan2(-ahead.x, ahead.z));
        }

        /// <summary>A pose in Unity, as a message of ROS.</summary>
        public static Geometry.Pose ToRos(Vector3 position, Quaternion rotation)
        {
            Geometry.Pose pose = new Geometry.Pose();
            pose.position.x = position.z;
            pose.position.y = -position.x;
            pose.position.z = position.y;
            pose.orientation.x = -rotation.z;
            pose.orientation.y = rotation.x;
            pose.orientation.z = -rotation.y;
            pose.orientation.w = rotation.w;
            return pose;
        }
    }
}
