/** The part of W3C's registry of input profiles that the page needs; `input_profiles.mjs` takes it while the page is bundled. */
declare module "farsteer:input-profiles" {
  const profiles: Readonly<Record<string, Readonly<Record<string, import("./controller_layout").ControllerLayout | undefined>> | undefined>>;
  export default profiles;
}
