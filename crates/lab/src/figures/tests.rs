//! Every figure is sound SVG, whatever the data.

use super::*;

/// Names that an SVG must escape or can't hold.
const ODD: &str = "<b>&\"' \u{1}\u{202e}é";

fn check(svg: &str, texts: &[&str]) {
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{svg}");
    assert!(!svg.contains("<b>") && !svg.contains('\u{1}') && !svg.contains('\u{202e}'), "{svg}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    assert!(texts.iter().all(|text| svg.contains(text)), "{texts:?}: {svg}");
}

#[test]
fn curves_have_names_fields_and_axes() {
    let curve = |name: &str, points: &[(f64, f64)]| Curve { name: name.to_owned(), points: points.to_vec() };
    let panel = CurvePanel {
        title: ODD.to_owned(),
        curves: vec![curve("1 thread", &[(10.0, 1.0), (1e5, 1e4)]), curve(ODD, &[(10.0, 5.0), (1e5, 5e3)])],
        fields: vec![Field { name: ODD.to_owned(), from: 300.0, to: f64::INFINITY }],
    };
    let curves = Curves { title: ODD.to_owned(), x_name: "objects", y_name: "time", panels: vec![panel; 5] };
    check(&curves.svg().unwrap(), &["1 thread", "objects", "time", "10 000"]);
    check(&Curves { panels: vec![CurvePanel::default()], ..curves.clone() }.svg().unwrap(), &[]);
    let panel = CurvePanel { curves: vec![curve("bvh", &[(1.0, 1.0), (16.0, 3.0)])], ..CurvePanel::default() };
    let svg = Curves { panels: vec![panel], x_name: "threads", y_name: "speed-up", ..curves }.svg().unwrap();
    check(&svg, &["1", "2", "4", "8", "16", "1.41", "2.83"].map(|n| format!("\n{n}\n")).each_ref().map(|n| &n[..]));
}

#[test]
fn ratios_show_what_is_known() {
    let rows = vec![(ODD.to_owned(), vec![Some(2.0), None]), ("clock".to_owned(), vec![Some(0.5), Some(f64::NAN)])];
    let ratios = Ratios { title: ODD.to_owned(), machines: vec!["a".to_owned(), ODD.to_owned()], rows };
    let svg = ratios.svg().unwrap();
    check(&svg, &["clock", "ratio to the reference"]);
}

#[test]
fn a_map_shows_cells_and_points() {
    let cell = |k: usize| Cell { from: (10.0, 0.1), to: (100.0, 1.0), algorithm: k };
    let panel = MapPanel { title: "measured".to_owned(), cells: vec![cell(0), cell(1)], points: vec![(20.0, 0.5, 1)] };
    let names = vec!["bvh@cpu1".to_owned(), ODD.to_owned()];
    let map = FieldMap { title: ODD.to_owned(), names, y_name: "pairs", panels: vec![panel.clone(), panel] };
    check(&map.svg().unwrap(), &["measured", "bvh@cpu1", "pairs"]);
}

#[test]
fn a_replay_shows_the_choice_and_its_caption() {
    let replay = Replay {
        title: "slab".to_owned(),
        chosen_ns: vec![1e6, 2e6, 9e6],
        chosen: vec![Some(0), None, Some(1)],
        fixed: vec![("bvh@cpu1".to_owned(), vec![1e6, f64::INFINITY, 3e6]), (ODD.to_owned(), vec![2e6; 3])],
        caption: vec![format!("Made by {}", "sapwise ".repeat(40)), ODD.to_owned()],
    };
    check(&replay.svg().unwrap(), &["slab", "bvh@cpu1", "frame", "chosen", "Made by"]);
    check(&Replay::default().svg().unwrap(), &[]);
}

#[test]
fn ranges_hold_what_is_above_zero() {
    assert_eq!(range([0.0, f64::NAN, 2.0, 8.0].into_iter(), 2.0), 1.0..16.0);
    assert_eq!(range([0.0].into_iter(), 2.0), 0.1..10.0);
}
