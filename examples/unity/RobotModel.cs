using System;
using System.Collections.Generic;
using System.Globalization;
using System.Xml;
using RosSharp.RosBridgeClient;
using UnityEngine;

namespace Farsteer
{
    /// <summary>
    /// Builds the robot, and its arm if it has one, from the URDF that it publishes: boxes, cylinders and spheres. It has
    /// no colliders: it only shows.
    /// </summary>
    public sealed class RobotModel : UnitySubscriber<RosSharp.RosBridgeClient.MessageTypes.Std.String>
    {
        /// <summary>The link that no joint carries, base_link; null until the URDF has come.</summary>
        public Transform Base { get; private set; }

        private sealed class Joint
        {
            public Transform Child;
            public bool Slides;
            public Vector3 Position;
            public Quaternion Rotation;
            public double[] Axis;
            public double Share;

            public void Set(double position)
            {
                if (Slides)
                {
                    double way = Share * position;
                    Child.localPosition = Position + Rotation * RosFrames.Point(Axis[0] * way, Axis[1] * way, Axis[2] * way);
                }
                else
                    Child.localRotation = Rotation * RosFrames.Turn(Axis[0], Axis[1], Axis[2], Share * position);
            }
        }

        private readonly Dictionary<string, List<Joint>> joints = new Dictionary<string, List<Joint>>();
        private volatile string received;

        protected override void Start()
        {
            Topic = "/robot_description";
            base.Start();
        }

        /// <summary>Moves a joint, and those that mimic it, to a position of ROS [rad or m]; others are ignored.</summary>
        public void Set(string name, double position)
        {
            List<Joint> moved;
            if (joints.TryGetValue(name, out moved))
                foreach (Joint joint in moved)
                    joint.Set(position);
        }

        // ROS# calls this in a thread of its own, where nothing of the scene may be touched.
        protected override void ReceiveMessage(RosSharp.RosBridgeClient.MessageTypes.Std.String message)
        {
            received = message.data;
        }

        private void Update()
        {
            if (received != null && Base == null)
                Build(received);
        }

        private void Build(string urdf)
        {
            XmlDocument document = new XmlDocument();
            document.LoadXml(urdf);
            Dictionary<string, Transform> links = new Dictionary<string, Transform>();
            foreach (XmlElement link in document.SelectNodes("/robot/link"))
            {
                Transform made = new GameObject(link.GetAttribute("name")).transform;
                made.SetParent(transform, false);
                links[made.name] = made;
                foreach (XmlElement visual in link.SelectNodes("visual"))
                    AddShape(made, visual, document);
            }
            HashSet<string> carried = new HashSet<string>();
            foreach (XmlElement element in document.SelectNodes("/robot/joint"))
            {
                string child = Attribute(element, "child/@link", "");
                carried.Add(child);
                AddJoint(element, links[child], links[Attribute(element, "parent/@link", "")]);
            }
            foreach (Transform link in links.Values)
                if (!carried.Contains(link.name))
                    Base = link;
        }

        private void AddJoint(XmlElement element, Transform child, Transform parent)
        {
            child.SetParent(parent, false);
            Place(child, element);
            string kind = element.GetAttribute("type");
            if (kind != "revolute" && kind != "continuous" && kind != "prismatic")
                return;
            string leader = Attribute(element, "mimic/@joint", element.GetAttribute("name"));
            if (!joints.ContainsKey(leader))
                joints[leader] = new List<Joint>();
            joints[leader].Add(new Joint
            {
                Child = child,
                Slides = kind == "prismatic",
                Position = child.localPosition,
                Rotation = child.localRotation,
                Axis = Numbers(Attribute(element, "axis/@xyz", "1 0 0")),
                Share = Numbers(Attribute(element, "mimic/@multiplier", "1"))[0],
            });
        }

        private static void AddShape(Transform link, XmlElement visual, XmlDocument document)
        {
            XmlElement shape = (XmlElement)visual.SelectSingleNode("geometry/*");
            GameObject made;
            if (shape.Name == "box")
            {
                double[] size = Numbers(shape.GetAttribute("size"));
                made = GameObject.CreatePrimitive(PrimitiveType.Cube);
                made.transform.localScale = RosFrames.Size(size[0], size[1], size[2]);
            }
            else if (shape.Name == "cylinder" || shape.Name == "sphere")
            {
                bool round = shape.Name == "sphere";
                double width = 2 * Numbers(shape.GetAttribute("radius"))[0];
                // Unity's cylinder is 2 high and stands along y, which is z of ROS.
                double height = round ? width : Numbers(shape.GetAttribute("length"))[0] / 2;
                made = GameObject.CreatePrimitive(round ? PrimitiveType.Sphere : PrimitiveType.Cylinder);
                made.transform.localScale = RosFrames.Size(width, width, height);
            }
            else
            {
                Debug.LogWarning("link " + link.name + ": a shape must be a box, cylinder or sphere, got " + shape.Name);
                return;
            }
            UnityEngine.Object.Destroy(made.GetComponent<Collider>());
            made.transform.SetParent(link, false);
            Place(made.transform, visual);
            string colour = Attribute(visual, "material/@name", "");
            double[] rgba = Numbers(Attribute(document.DocumentElement, "material[@name='" + colour + "']/color/@rgba", "1 1 1 1"));
            made.GetComponent<Renderer>().material.color =
                new Color((float)rgba[0], (float)rgba[1], (float)rgba[2], (float)rgba[3]);
        }

        private static void Place(Transform placed, XmlElement element)
        {
            double[] at = Numbers(Attribute(element, "origin/@xyz", "0 0 0"));
            double[] turned = Numbers(Attribute(element, "origin/@rpy", "0 0 0"));
            placed.localPosition = RosFrames.Point(at[0], at[1], at[2]);
            placed.localRotation = RosFrames.RollPitchYaw(turned[0], turned[1], turned[2]);
        }

        private static string Attribute(XmlElement element, string path, string unlessGiven)
        {
            XmlNode found = element.SelectSingleNode(path);
            return found == null ? unlessGiven : found.Value;
        }

        private static double[] Numbers(string text)
        {
            string[] words = text.Split(new[] { ' ' }, StringSplitOptions.RemoveEmptyEntries);
            return Array.ConvertAll(words, word => double.Parse(word, CultureInfo.InvariantCulture));
        }
    }
}
