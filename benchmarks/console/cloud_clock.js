/** Notes when the newest frame arrived, before any library's own listener; loaded before the libraries. */
window.WebSocket = class extends WebSocket {
  constructor(...options) {
    super(...options);
    this.addEventListener("message", () => { window.arrivedAt = performance.now(); });
  }
};
/** A cloud was read: when its decoded message came [ms], and how many points the buffers hold. */
window.times = [];
window.noteCloud = (decodedAt, points) => {
  const done = performance.now();
  window.times.push({ points, whole: done - window.arrivedAt, reader: done - decodedAt });
};
