/** Whether pictures are drawn by the processor: where there is no graphics card, or its driver is not trusted. */

/** What renderers by the processor call themselves: Chromium's, Mesa's two, and Windows' own. */
const NAMES = /swiftshader|llvmpipe|softpipe|basic render/i;

/** Return whether the browser draws without a graphics card; false where it does not say, and without WebGL. */
export const drawsInSoftware = (): boolean => {
  const context = document.createElement("canvas").getContext("webgl2");
  // Browsers leave the names out for pages that must not tell one machine from another.
  const names = context?.getExtension("WEBGL_debug_renderer_info");
  const name: unknown = context && names ? context.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return NAMES.test(String(name));
};
