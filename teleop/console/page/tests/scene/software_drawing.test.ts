import { afterEach, describe, expect, test, vi } from "./tools";
import { drawsInSoftware } from "../../src/scene/software_drawing";

afterEach(() => { vi.restoreAllMocks(); });

const named = (name: string | undefined): void => {
  const context = {
    getExtension: (extension: string) => extension === "WEBGL_lose_context" ? { loseContext: () => undefined } : name === undefined ? null : { UNMASKED_RENDERER_WEBGL: 1 },
    getParameter: () => name,
  };
  vi.spyOn(HTMLCanvasElement.prototype, "getContext").mockImplementation((() => context) as never);
};

describe("a renderer", () => {
  test.each([
    ["ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device (Subzero) (0x0000C0DE)), SwiftShader driver)", true],
    ["llvmpipe (LLVM 15.0.6, 256 bits)", true],
    ["ANGLE (NVIDIA, NVIDIA GeForce RTX 3060, OpenGL 4.5)", false],
    [undefined, false],
  ])("%s draws by the processor: %s", (name, expected) => {
    named(name);
    expect(drawsInSoftware()).toBe(expected);
  });
});
