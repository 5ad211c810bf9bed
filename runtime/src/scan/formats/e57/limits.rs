//! Limits of the XML section, held before it is parsed: the parser's time grows with the square of the number of an
//! element's attributes, and with that of the namespaces.

use super::FORMAT;
use crate::scan::error::ScanFault;

/// The most attributes of an element. Elements of the format have six.
const MOST_ATTRIBUTES: usize = 100;
/// The most namespaces. Each extension has one.
const MOST_NAMESPACES: usize = 100;

/// Holds the limits against a text.
pub(super) fn check(xml: &str) -> Result<(), ScanFault> {
    let fault = |message: String| Err(ScanFault::malformed(FORMAT, "XML section", message));
    if xml.matches("xmlns").nth(MOST_NAMESPACES).is_some() {
        return fault(format!("there are more than {MOST_NAMESPACES} namespaces; export the file again"));
    }
    let mut rest = xml;
    while let Some(start) = rest.find('<') {
        rest = &rest[start + 1..];
        // Within these, brackets and quotes mean nothing.
        let plain = [("!--", "-->"), ("![CDATA[", "]]>"), ("?", "?>")];
        if let Some((begin, end)) = plain.into_iter().find(|(begin, _)| rest.starts_with(begin)) {
            let Some(at) = rest[begin.len()..].find(end) else { break };
            rest = &rest[begin.len() + at + end.len()..];
            continue;
        }
        let (attributes, length) = attributes(rest);
        if attributes > MOST_ATTRIBUTES {
            return fault(format!("an element has more than {MOST_ATTRIBUTES} attributes; export the file again"));
        }
        rest = &rest[length..];
    }
    Ok(())
}

/// The number of attributes in a tag, and its length.
fn attributes(tag: &str) -> (usize, usize) {
    let (mut count, mut quote) = (0, None);
    for (at, byte) in tag.bytes().enumerate() {
        match (quote, byte) {
            (None, b'>') => return (count, at),
            (None, b'=') => count += 1,
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(end), _) if byte == end => quote = None,
            _ => {}
        }
    }
    (count, tag.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_and_namespaces_are_counted() {
        let many = "a=\"\" ".repeat(101);
        assert!(check(&format!("<!-- \" --><![CDATA[<x \"]]><?p ' ?><e b='>'/><f {many}/>")).is_err());
        assert!(
            check(&format!("<!-- {many} --><e><![CDATA[{many}]]>{many}</e><f a=\"{}\"/>", many.replace('"', "'")))
                .is_ok()
        );
        assert!(check(&"<a xmlns:b=\"c\">".repeat(101)).is_err());
        assert!(["", "<", "<!--", "<a b=\"", "</", "ü<ü>"].into_iter().all(|xml| check(xml).is_ok()));
    }
}
