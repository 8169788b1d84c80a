//! An SVG file as a part of a page.

use maud::{Markup, Render, html};

/// The picture as an element of HTML that is as wide as there is room, with `alt` for those who do not see it. `None` where it is no
/// SVG or does not say how large it is.
///
/// Only for SVG that this program drew: it is not escaped. Its text is what plotters escaped.
pub(super) fn inline(svg: &str, id: &str, alt: &str) -> Option<String> {
    // What stands before is the prolog and the type of an XML file, which HTML does not have.
    let tag = &svg[svg.find("<svg")? + "<svg".len()..];
    let (attributes, body) = tag.split_once('>')?;
    let body = &body[..body.rfind("</svg>")?];
    let attributes = attributes.split('"').collect::<Vec<_>>();
    let value = |name: &str| attributes.chunks_exact(2).find(|a| a[0].trim() == format!("{name}=")).map(|a| a[1]);
    let view = match (value("viewBox"), value("width"), value("height")) {
        (Some(view), _, _) => view.to_owned(),
        (None, Some(width), Some(height)) => format!("0 0 {width} {height}"),
        _ => return None,
    };
    let title: Markup = html! { title id={ (id) "-title" } { (alt) } };
    let view = view.render().into_string();
    let title = title.into_string();
    Some(format!(
        "<svg role=\"img\" aria-labelledby=\"{id}-title\" viewBox=\"{view}\">{title}{}</svg>",
        apart(body, id)
    ))
}

/// The body with `id` before each of its own names, so that two figures do not share one: a browser would take the first of them for
/// both.
fn apart(body: &str, id: &str) -> String {
    let names = body.split(" id=\"").skip(1).filter_map(|rest| rest.split('"').next());
    names.fold(body.to_owned(), |body, name| {
        let mut body = body;
        for (before, after) in [(" id=\"", "\""), ("url(#", ")"), ("href=\"#", "\"")] {
            body = body.replace(&format!("{before}{name}{after}"), &format!("{before}{id}-{name}{after}"));
        }
        body
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_becomes_an_element() {
        let file = "<?xml version=\"1.0\"?>\n<!DOCTYPE svg>\n<svg width=\"600\" height=\"400\" viewBox=\"0 0 600 400\" \
                    xmlns=\"http://www.w3.org/2000/svg\">\n<rect fill=\"#FFFFFF\"/>\n</svg>\n";
        let element = "<svg role=\"img\" aria-labelledby=\"f-title\" viewBox=\"0 0 600 400\"><title id=\"f-title\">a &lt; b</title>\n\
                       <rect fill=\"#FFFFFF\"/>\n</svg>";
        assert_eq!(inline(file, "f", "a < b").unwrap(), element);
    }

    #[test]
    fn a_size_is_a_view() {
        let element = inline("<svg height=\"4\" width=\"6\"></svg>", "f", "").unwrap();
        assert!(element.contains("viewBox=\"0 0 6 4\""), "{element}");
    }

    #[test]
    fn what_is_no_picture_is_not_shown() {
        for file in ["", "no picture", "<svg></svg>", "<svg viewBox=\"0 0 1 1\"/>", "<svg", "<svg width=\"3\"></svg>"] {
            assert_eq!(inline(file, "f", ""), None, "{file}");
        }
    }

    #[test]
    fn names_differ_between_figures() {
        let file = "<svg width=\"1\" height=\"1\"><clipPath id=\"c\"/><g clip-path=\"url(#c)\"><use href=\"#c\"/>url(#d)</g></svg>";
        let element = inline(file, "f", "").unwrap();
        assert!(
            element.ends_with("<clipPath id=\"f-c\"/><g clip-path=\"url(#f-c)\"><use href=\"#f-c\"/>url(#d)</g></svg>"),
            "{element}"
        );
    }
}
