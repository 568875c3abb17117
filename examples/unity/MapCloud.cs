using System;
using System.Collections;
using System.Security.Cryptography;
using RosSharp.RosBridgeClient;
using UnityEngine;
using UnityEngine.Networking;

namespace Farsteer
{
    /// <summary>
    /// Loads the map that the robot localises in, as a file over HTTP from the same port, and shows it. The robot
    /// announces its hash: another file than the robot's is never shown.
    /// </summary>
    public sealed class MapCloud : UnitySubscriber<MapInfo>
    {
        public Material Material;

        /// <summary>The cloud that is shown; null until it is loaded.</summary>
        public PointCloud Cloud { get; private set; }

        private volatile MapInfo announced;
        private string loading = "";

        protected override void Start()
        {
            Topic = "/map_info";
            base.Start();
        }

        // ROS# calls this in a thread of its own, where nothing of the scene may be touched.
        protected override void ReceiveMessage(MapInfo message)
        {
            announced = message;
        }

        private void Update()
        {
            MapInfo info = announced;
            if (info == null || info.sha256 == loading)
                return;
            loading = info.sha256;
            StartCoroutine(Load(info));
        }

        private IEnumerator Load(MapInfo info)
        {
            UriBuilder address = new UriBuilder(GetComponent<RosConnector>().RosBridgeServerUrl);
            address.Scheme = address.Scheme == "wss" ? "https" : "http";
            address.Path = "/map/" + info.sha256 + ".ply";
            using (UnityWebRequest request = UnityWebRequest.Get(address.Uri.AbsoluteUri))
            {
                yield return request.SendWebRequest();
                if (request.result != UnityWebRequest.Result.Success)
                {
                    Debug.LogError("map of " + info.name + ": " + request.error);
                    yield break;
                }
                Show(info, request.downloadHandler.data);
            }
        }

        private void Show(MapInfo info, byte[] file)
        {
            using (SHA256 hash = SHA256.Create())
            {
                string found = BitConverter.ToString(hash.ComputeHash(file)).Replace("-", "").ToLowerInvariant();
                if (found != info.sha256)
                {
                    Debug.LogError("the map must have the SHA-256 " + info.sha256 + ", got " + found);
                    return;
                }
            }
            Cloud = PointCloud.ReadPly(file);
            Color32[] colours = new Color32[Cloud.Points.Length];
            for (int i = 0; i < colours.Length; i++)
            {
                byte grey = (byte)Mathf.Clamp(60 + 60 * Cloud.Points[i].y, 60, 240); // lighter with height
                colours[i] = new Color32(grey, grey, grey, 255);
            }
            new PointMesh(transform, "map " + info.name, Material).Show(Cloud.Points, colours);
        }
    }
}
