// The part of Unity's API that examples/unity uses, declared as Unity's scripting reference (2022.3) declares it, and as
// much of its behaviour as a console program needs: a tree of objects, frames, and input that a test sets.

using System;
using System.Collections;
using System.Collections.Generic;
using System.IO;
using System.Net;
using System.Reflection;

namespace UnityEngine
{
    public struct Vector3
    {
        public float x, y, z;

        public Vector3(float x, float y, float z)
        {
            this.x = x;
            this.y = y;
            this.z = z;
        }

        public static Vector3 one { get { return new Vector3(1, 1, 1); } }
        public float magnitude { get { return (float)Math.Sqrt((double)x * x + (double)y * y + (double)z * z); } }

        public static Vector3 operator +(Vector3 a, Vector3 b) { return new Vector3(a.x + b.x, a.y + b.y, a.z + b.z); }
        public static Vector3 operator -(Vector3 a, Vector3 b) { return new Vector3(a.x - b.x, a.y - b.y, a.z - b.z); }
        public static Vector3 operator *(Vector3 a, float d) { return new Vector3(a.x * d, a.y * d, a.z * d); }
    }

    public struct Quaternion
    {
        public float x, y, z, w;

        public Quaternion(float x, float y, float z, float w)
        {
            this.x = x;
            this.y = y;
            this.z = z;
            this.w = w;
        }

        public static Quaternion identity { get { return new Quaternion(0, 0, 0, 1); } }

        // The product in Unity's documentation of the operators: rhs first, then lhs.
        public static Quaternion operator *(Quaternion a, Quaternion b)
        {
            return new Quaternion(
                a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z,
                a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x,
                a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z);
        }

        public static Vector3 operator *(Quaternion q, Vector3 v)
        {
            Quaternion turned = q * new Quaternion(v.x, v.y, v.z, 0) * new Quaternion(-q.x, -q.y, -q.z, q.w);
            return new Vector3(turned.x, turned.y, turned.z);
        }
    }

    public struct Color
    {
        public float r, g, b, a;

        public Color(float r, float g, float b, float a)
        {
            this.r = r;
            this.g = g;
            this.b = b;
            this.a = a;
        }
    }

    public struct Color32
    {
        public byte r, g, b, a;

        public Color32(byte r, byte g, byte b, byte a)
        {
            this.r = r;
            this.g = g;
            this.b = b;
            this.a = a;
        }
    }

    public static class Mathf
    {
        public static float Abs(float f) { return Math.Abs(f); }
        public static float Clamp(float value, float min, float max) { return Math.Max(min, Math.Min(max, value)); }
    }

    [AttributeUsage(AttributeTargets.Class, AllowMultiple = true)]
    public sealed class RequireComponent : Attribute
    {
        public readonly Type[] Types;

        public RequireComponent(Type a) { Types = new[] { a }; }
        public RequireComponent(Type a, Type b) { Types = new[] { a, b }; }
        public RequireComponent(Type a, Type b, Type c) { Types = new[] { a, b, c }; }
    }

    public class Object
    {
        public virtual string name { get; set; }

        public static void Destroy(Object obj)
        {
            if (obj == null)
                throw new ArgumentNullException("obj");
        }
    }

    public class Component : Object
    {
        public GameObject gameObject { get; internal set; }
        public Transform transform { get { return gameObject.transform; } }
        public override string name { get { return gameObject.name; } set { gameObject.name = value; } }
        public T GetComponent<T>() { return gameObject.GetComponent<T>(); }
    }

    public class Transform : Component
    {
        public Vector3 localPosition;
        public Quaternion localRotation = Quaternion.identity;
        public Vector3 localScale = Vector3.one;
        private Transform parent;

        public Quaternion rotation { get { return parent == null ? localRotation : parent.rotation * localRotation; } }
        public Vector3 up { get { return rotation * new Vector3(0, 1, 0); } }

        // Links have no scale, and shapes no children.
        public Vector3 position
        {
            get { return parent == null ? localPosition : parent.position + parent.rotation * localPosition; }
        }

        public void SetParent(Transform p, bool worldPositionStays) { parent = p; }

        public Vector3 InverseTransformPoint(Vector3 position)
        {
            Quaternion q = rotation;
            return new Quaternion(-q.x, -q.y, -q.z, q.w) * (position - this.position);
        }
    }

    public class Behaviour : Component { }

    public class MonoBehaviour : Behaviour
    {
        internal bool Started;

        public object StartCoroutine(IEnumerator routine)
        {
            while (routine.MoveNext()) { } // What is waited for here has ended when it is returned.
            return null;
        }
    }

    public enum PrimitiveType { Sphere, Capsule, Cylinder, Cube, Plane, Quad }

    public sealed class GameObject : Object
    {
        public static readonly List<GameObject> All = new List<GameObject>();
        internal readonly List<Component> Components = new List<Component>();

        public GameObject(string name)
        {
            this.name = name;
            transform = new Transform { gameObject = this };
            All.Add(this);
        }

        public Transform transform { get; private set; }

        public static GameObject CreatePrimitive(PrimitiveType type)
        {
            GameObject made = new GameObject(type.ToString());
            made.AddComponent<MeshRenderer>();
            made.AddComponent<Collider>();
            return made;
        }

        public T AddComponent<T>() where T : Component { return (T)Add(typeof(T)); }
        public T GetComponent<T>() { return (T)(object)Components.Find(component => component is T); }

        private Component Add(Type type)
        {
            foreach (RequireComponent required in type.GetCustomAttributes(typeof(RequireComponent), true))
                foreach (Type other in required.Types)
                    if (!Components.Exists(other.IsInstanceOfType))
                        Add(other);
            Component made = (Component)Activator.CreateInstance(type);
            made.gameObject = this;
            Components.Add(made);
            Frames.Send(made, "Awake");
            return made;
        }
    }

    public static class Frames
    {
        /// <summary>One frame: Start of what is new, then Update of all, as Unity calls them.</summary>
        public static void Next(float seconds)
        {
            Time.unscaledTime += seconds;
            foreach (GameObject part in GameObject.All.ToArray())
                foreach (Component component in part.Components.ToArray())
                {
                    MonoBehaviour script = component as MonoBehaviour;
                    if (script == null)
                        continue;
                    if (!script.Started)
                        Send(script, "Start");
                    script.Started = true;
                    Send(script, "Update");
                }
            Input.Down.Clear();
            Input.Pressed.Clear();
            Input.Released.Clear();
        }

        internal static void Send(object to, string message)
        {
            const BindingFlags any = BindingFlags.Instance | BindingFlags.Public | BindingFlags.NonPublic;
            MethodInfo method = to.GetType().GetMethod(message, any, null, Type.EmptyTypes, null);
            if (method != null)
                method.Invoke(to, null);
        }
    }

    public static class Time
    {
        public static float unscaledTime { get; internal set; }
    }

    public static class Application
    {
        public static bool isFocused { get; set; }
    }

    public enum KeyCode { Space, R, LeftShift, LeftControl, JoystickButton1, JoystickButton4, JoystickButton5 }

    public static class Input
    {
        public static readonly HashSet<KeyCode> Held = new HashSet<KeyCode>();
        public static readonly HashSet<KeyCode> Down = new HashSet<KeyCode>();
        public static readonly Dictionary<string, float> Axes = new Dictionary<string, float>();
        public static Vector3 mousePosition { get; set; }

        public static bool GetKey(KeyCode key) { return Held.Contains(key); }
        public static bool GetKeyDown(KeyCode key) { return Down.Contains(key); }
        public static readonly HashSet<int> Pressed = new HashSet<int>();
        public static readonly HashSet<int> Released = new HashSet<int>();
        public static bool GetMouseButtonDown(int button) { return Pressed.Contains(button); }
        public static bool GetMouseButtonUp(int button) { return Released.Contains(button); }

        public static float GetAxis(string axisName)
        {
            float value;
            return Axes.TryGetValue(axisName, out value) ? value : 0;
        }
    }

    public struct Ray
    {
        public Vector3 origin, direction;
        public Vector3 GetPoint(float distance) { return origin + direction * distance; }
    }

    public struct Plane
    {
        private readonly Vector3 normal, point;

        public Plane(Vector3 inNormal, Vector3 inPoint)
        {
            normal = inNormal;
            point = inPoint;
        }

        public bool Raycast(Ray ray, out float enter)
        {
            enter = Dot(normal, point - ray.origin) / Dot(normal, ray.direction);
            return enter > 0;
        }

        private static float Dot(Vector3 a, Vector3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
    }

    public sealed class Camera : Behaviour
    {
        public static Camera main { get { return new Camera(); } }

        // A camera that looks straight down from 10 m, with a pixel for each metre.
        public Ray ScreenPointToRay(Vector3 pos)
        {
            return new Ray { origin = new Vector3(pos.x, 10, pos.y), direction = new Vector3(0, -1, 0) };
        }
    }

    public static class Debug
    {
        public static void Log(object message) { Console.WriteLine(message); }
        public static void LogWarning(object message) { Console.WriteLine("warning: " + message); }
        public static void LogError(object message) { Console.WriteLine("error: " + message); }
    }

    public class Collider : Component { }

    public sealed class Material : Object
    {
        public Color color { get; set; }
    }

    public class Renderer : Component
    {
        private readonly Material own = new Material();
        public Material material { get { return own; } }
        public Material sharedMaterial { get; set; }
    }

    public sealed class MeshRenderer : Renderer { }

    public sealed class MeshFilter : Component
    {
        public Mesh sharedMesh { get; set; }
    }

    public enum MeshTopology { Triangles = 0, Quads = 2, Lines = 3, LineStrip = 4, Points = 5 }

    public sealed class Mesh : Object
    {
        private int[] indices;
        public Rendering.IndexFormat indexFormat { get; set; }
        public Vector3[] vertices { get; set; }
        public Color32[] colors32 { get; set; }
        public void Clear() { vertices = null; }

        public void SetIndices(int[] indices, MeshTopology topology, int submesh)
        {
            if (vertices.Length != colors32.Length || vertices.Length != indices.Length || topology != MeshTopology.Points)
                throw new ArgumentException("a colour and an index for each point");
            this.indices = indices;
        }

        public int Shown { get { return indices == null ? 0 : indices.Length; } }
    }
}

namespace UnityEngine.Rendering
{
    public enum IndexFormat { UInt16, UInt32 }
}

namespace UnityEngine.Networking
{
    public sealed class DownloadHandler
    {
        public byte[] data { get; internal set; }
    }

    public sealed class UnityWebRequest : IDisposable
    {
        public enum Result { InProgress, Success, ConnectionError, ProtocolError, DataProcessingError }

        private readonly string uri;
        private UnityWebRequest(string uri) { this.uri = uri; }

        public Result result { get; private set; }
        public string error { get; private set; }
        public DownloadHandler downloadHandler { get; private set; }

        public static UnityWebRequest Get(string uri) { return new UnityWebRequest(uri); }
        public void Dispose() { }

        public object SendWebRequest()
        {
            try
            {
                using (WebResponse answer = WebRequest.Create(uri).GetResponse())
                using (MemoryStream body = new MemoryStream())
                {
                    answer.GetResponseStream().CopyTo(body);
                    downloadHandler = new DownloadHandler { data = body.ToArray() };
                    result = Result.Success;
                }
            }
            catch (WebException exception)
            {
                error = exception.Message;
                result = Result.ProtocolError;
            }
            return null;
        }
    }
}
