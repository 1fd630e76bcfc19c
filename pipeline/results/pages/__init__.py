"""Pages for people: self-contained, printable HTML without scripts. The template engine escapes every text."""
