// Plays the robot's camera: one offer to the robot itself, and no ICE server.
const video = document.querySelector("video");
const status = document.querySelector("[role=status]");
const connection = new RTCPeerConnection();

connection.ontrack = (event) => {
  video.srcObject = event.streams[0] ?? new MediaStream([event.track]);
  event.receiver.jitterBufferTarget = 0; // live driving: late pictures are of no use
};
connection.onconnectionstatechange = () => {
  status.textContent = connection.connectionState;
};
window.addEventListener("pagehide", () => connection.close());

async function play() {
  connection.addTransceiver("video", { direction: "recvonly" });
  await connection.setLocalDescription();
  const response = await fetch(`/webrtc/offer${location.search}`, {
    method: "POST",
    headers: { "Content-Type": "application/sdp" },
    body: connection.localDescription.sdp,
  });
  const text = await response.text();
  if (!response.ok) {
    throw new Error(text);
  }
  await connection.setRemoteDescription({ type: "answer", sdp: text });
}

play().catch((error) => {
  status.textContent = error.message;
});
