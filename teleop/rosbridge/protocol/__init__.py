"""The rosbridge v2 protocol without sockets: operations in, frames out."""
