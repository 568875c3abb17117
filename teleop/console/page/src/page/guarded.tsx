/** Keeps a fault of one part from taking the others down. */

import { Component, type ComponentChildren } from "preact";
import { pageTexts as texts } from "../texts/page";

interface GuardedProps {
  readonly name: string;
  readonly children: ComponentChildren;
}

/** Shows its children, or a sentence in their place once drawing them has failed, with a way to try again. */
export class Guarded extends Component<GuardedProps, { readonly failed: string }> {
  constructor(props: GuardedProps) {
    super(props);
    this.state = { failed: "" };
  }

  override componentDidCatch(error: unknown): void {
    this.setState({ failed: error instanceof Error ? error.message : String(error) });
  }

  override render() {
    if (this.state.failed === "") {
      return this.props.children;
    }
    return (
      <p class="page-failed" role="alert">
        {texts.failed(this.props.name, this.state.failed)}
        {" "}
        <button type="button" onClick={() => { this.setState({ failed: "" }); }}>{texts.again}</button>
      </p>
    );
  }
}
