//! Text inside the elements of XML and HTML.

/// Escapes the characters that markup reserves between tags. Attributes need quotes escaped too.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
