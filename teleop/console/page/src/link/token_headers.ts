/** The headers by which the robot knows a token; none without one. */
export function tokenHeaders(token: string): Record<string, string> {
  return token === "" ? {} : { Authorization: `Bearer ${token}` };
}
