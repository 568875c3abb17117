"""Operations as WebSocket frames: JSON, field checks, fragments, PNG, outgoing frames."""
