/**
 * Takes the place of the package bson in the built page. Of it roslib wants this one function, for servers
 * that send BSON, which the page never asks for; bson itself compiles WebAssembly as it is loaded, which the
 * page's Content-Security-Policy refuses.
 */
export function deserialize(): never {
  throw new Error("a binary message is BSON, which this page does not read");
}
