"""Operations as WebSocket frames: reading and validating JSON, fragments, PNG, outgoing frames."""
