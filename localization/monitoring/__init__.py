"""Whether the estimate can be trusted: health, jumps, scanner extrinsics."""
