"""Message types: definitions, validation, and their encoding in JSON, CBOR and CDR."""
