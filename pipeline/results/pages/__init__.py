"""Pages for people: self-contained HTML, no script, printable. Every text is escaped by the template engine."""
