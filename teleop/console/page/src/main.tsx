/** Puts the page together. */

import { render } from "preact";

const root = document.getElementById("console");
if (root !== null) {
  render(<main>Farsteer console</main>, root);
}
