//! Tests of all pictures.

use super::*;

#[test]
fn the_name_of_the_file_says_how_it_is_stored() {
    assert_eq!(Picture::of(Path::new("a.svg")).unwrap(), Picture::Svg);
    assert_eq!(Picture::of(Path::new("b.c/a.png")).unwrap(), Picture::Png);
    for other in ["a", "a.pdf", "svg"] {
        assert!(Picture::of(Path::new(other)).unwrap_err().to_string().contains(".svg or .png"));
    }
}
