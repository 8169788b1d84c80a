//! Tests of all pictures, most of them with data that is not as it should be.

use super::canvas::PNG_UNIT;
use super::style::{INK, SECONDARY};
use super::*;
use crate::evaluate::Verdict;
use plotters::style::RGBColor;
use std::path::Path;

/// Characters that mean something in SVG, that the font lacks, that XML forbids, and that turn text around.
const ODD: &str = "<b>&\"it's\" é日\u{1}\u{202e}]]>";
/// How they are in an SVG.
const ESCAPED: &str = "&lt;b&gt;&amp;&quot;it&apos;s&quot; é日??]]&gt;";
/// Values that no axis has a place for, and those that are far from each other.
const AWKWARD: [f64; 10] =
    [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, 1e12, 1e-12, f64::MAX, f64::MIN_POSITIVE, 1.0];

/// Draws a figure both ways, checks what every picture must be, and returns the SVG and how many pixels of the PNG are dark.
fn drawn(figure: &dyn Figure) -> (String, usize) {
    let caption = [format!("Sources: {ODD}.json"), "Made by: sapwise study".to_owned()];
    let svg = String::from_utf8(figure.draw(Picture::Svg, &caption).unwrap()).unwrap();
    assert!(svg.contains(&format!("Sources: {ESCAPED}.json")) && svg.contains("Made by: sapwise study"), "{svg}");
    well_formed(&svg);
    let size: Vec<u32> = ["width", "height"].iter().map(|name| attribute(&svg, name).parse().unwrap()).collect();
    in_style(&svg, size[0], size[1]);
    let file = figure.draw(Picture::Png, &caption).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height), (PNG_UNIT * size[0], PNG_UNIT * size[1]));
    let dark = pixels.chunks(3).filter(|p| p.iter().all(|&c| c < 120)).count();
    assert!(dark > 200, "the letters of the caption at least: {dark}");
    (svg, dark)
}

fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
    tag.split_once(&format!(" {name}=\"")).unwrap().1.split_once('"').unwrap().0
}

/// Every element is closed, and no text has a character that XML forbids.
fn well_formed(svg: &str) {
    let mut open = Vec::new();
    for part in svg.split('<').skip(1) {
        let (tag, text) = part.split_once('>').unwrap();
        assert!(!text.contains('>') && tag.matches('"').count() % 2 == 0, "{part}");
        let entities = text.match_indices('&').map(|(at, _)| &text[at..]);
        let known = ["&lt;", "&gt;", "&amp;", "&quot;", "&apos;"];
        assert!(entities.into_iter().all(|e| known.iter().any(|k| e.starts_with(k))), "{text}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(tag.split(' ').next().unwrap());
        }
    }
    assert!(open.is_empty(), "{open:?}");
    assert!(svg.chars().all(|c| c == '\n' || !c.is_control()));
}

/// Every number is one and inside the picture, and there are no colours but those of the style.
fn in_style(svg: &str, width: u32, height: u32) {
    let neutral = [style::GROUND, INK, SECONDARY, style::GRID];
    let colours: Vec<String> = (0..11)
        .map(style::colour)
        .chain(neutral)
        .map(|RGBColor(r, g, b)| format!("#{r:02X}{g:02X}{b:02X}"))
        .chain(["none".to_owned()])
        .collect();
    for tag in svg.split('<').skip(2).filter(|part| !part.starts_with('/')) {
        let tag = tag.split_once('>').unwrap().0;
        for attribute in tag.split("\" ").filter_map(|a| a.split_once("=\"")) {
            let (name, value) = (attribute.0.rsplit(' ').next().unwrap(), attribute.1.trim_end_matches(['"', '/']));
            let inside = |text: &str, most: u32| {
                let number: f64 = text.parse().unwrap_or_else(|_| panic!("{text} in {tag}"));
                assert!((-1.0..=f64::from(most) + 1.0).contains(&number), "{tag} of {width} x {height}");
            };
            match name {
                "fill" | "stroke" => assert!(colours.iter().any(|c| c == value), "{tag}"),
                "x" | "cx" | "x1" | "x2" | "width" => inside(value, width),
                "y" | "cy" | "y1" | "y2" | "height" => inside(value, height),
                "points" => {
                    for pair in value.split_whitespace() {
                        let (x, y) = pair.split_once(',').unwrap();
                        inside(x, width);
                        inside(y, height);
                    }
                }
                _ => {}
            }
        }
    }
}

fn curve(style: usize, values: &[(f64, f64)]) -> Curve {
    let point = |&(objects, ns): &(f64, f64)| CurvePoint { objects, ns, low_ns: 0.9 * ns, high_ns: 1.2 * ns };
    Curve { name: format!("sap@cpu{style}"), style, points: values.iter().map(point).collect() }
}

fn every_pair() -> Vec<(f64, f64)> {
    AWKWARD.iter().flat_map(|&a| AWKWARD.iter().map(move |&b| (a, b))).collect()
}

#[test]
fn the_name_of_the_file_says_how_it_is_stored() {
    assert_eq!(Picture::of(Path::new("a.svg")).unwrap(), Picture::Svg);
    assert_eq!(Picture::of(Path::new("b.c/a.png")).unwrap(), Picture::Png);
    for other in ["a", "a.pdf", "svg"] {
        assert!(Picture::of(Path::new(other)).unwrap_err().to_string().contains(".svg or .png"));
    }
}

#[test]
fn a_caption_of_any_length_has_room() {
    let figure = Curves::default();
    let height = |caption: &[String]| {
        let svg = String::from_utf8(figure.draw(Picture::Svg, caption).unwrap()).unwrap();
        attribute(&svg, "height").parse::<u32>().unwrap()
    };
    let long = "sapwise study report.json ".repeat(40);
    let (none, two, many) = (height(&[]), height(&[long[..40].to_owned(), "b".to_owned()]), height(&[long]));
    assert!(none < two && two < many, "{none} {two} {many}");
    assert!(height(&["x".repeat(1_000_000)]) < 800);
}

#[test]
fn curves_show_fields_and_crossovers() {
    let panel = CurvePanel {
        title: format!("panel {ODD}"),
        series: vec![curve(1, &[(10.0, 1e3), (1e4, 1e7)]), curve(4, &[(10.0, 1e5), (1e4, 1e6)])],
        fields: vec![
            Band { from: 0.0, to: 800.0, style: 1, name: "sap@cpu1".to_owned() },
            Band { from: 800.0, to: f64::INFINITY, style: 4, name: "sap@cpu4".to_owned() },
        ],
        crossovers: vec![CrossoverLine { objects: 800.0, low: 700.0, high: 950.0 }],
    };
    let one = Curves { title: format!("title {ODD}"), panels: vec![panel.clone()] };
    let (svg, _) = drawn(&one);
    let titles = [format!("title {ESCAPED}"), format!("panel {ESCAPED}")];
    assert!(titles.iter().all(|t| svg.contains(t)), "{svg}");
    assert!(svg.contains("objects\n") && svg.contains("time of a frame (us)") && svg.contains("crossover, with"));
    // In the legend and in the row of fields.
    assert_eq!((svg.matches("sap@cpu1\n").count(), svg.matches("sap@cpu4\n").count()), (2, 2), "{svg}");
    for RGBColor(r, g, b) in [1, 4].map(style::colour) {
        assert!(svg.contains(&format!("opacity=\"{}\" fill=\"#{r:02X}{g:02X}{b:02X}\"", style::FIELD)), "{svg}");
    }
    let four = Curves { title: String::new(), panels: vec![panel; 4] };
    // One legend for all, and every panel its row of fields.
    assert_eq!(drawn(&four).0.matches("sap@cpu1\n").count(), 5);
}

#[test]
fn any_curves_are_drawn() {
    let with = |series: Vec<Curve>| {
        let ends = every_pair();
        let fields = ends.iter().map(|&(from, to)| Band { from, to, style: 3, name: ODD.to_owned() }).collect();
        let crossovers = ends.iter().map(|&(low, high)| CrossoverLine { objects: low, low, high }).collect();
        Curves { title: String::new(), panels: vec![CurvePanel { title: String::new(), series, fields, crossovers }] }
    };
    for (figure, sentence) in [
        (Curves::default(), true),
        (Curves { title: String::new(), panels: vec![CurvePanel::default(); 3] }, true),
        (with(Vec::new()), true),
        (with(vec![curve(0, &[(f64::NAN, 1.0), (1.0, f64::NAN)])]), true),
        (with(vec![curve(0, &[(5.0, 7.0)])]), false),
        (with(vec![curve(0, &[(5.0, 7.0), (5.0, 7.0), (5.0, 7.000001)])]), false),
        (with(vec![curve(0, &every_pair())]), false),
    ] {
        assert_eq!(drawn(&figure).0.contains("no times were measured"), sentence, "{figure:?}");
    }
    let many = with((0..200).map(|k| curve(k, &[(10.0, 1e3 * k as f64), (1e4, 1e6)])).collect());
    let (svg, _) = drawn(&many);
    assert!((0..200).all(|k| svg.contains(&format!("sap@cpu{k}\n"))));
}

#[test]
fn no_two_of_two_hundred_series_look_alike() {
    let dashes: Vec<&[i32]> = (0..5).map(style::dashes).collect();
    let looks = |k: usize| {
        let RGBColor(r, g, b) = style::colour(k);
        ((r, g, b), format!("{:?}", style::mark(k)), dashes.iter().position(|d| *d == style::dashes(k)))
    };
    let all: std::collections::BTreeSet<_> = (0..200).map(looks).collect();
    assert_eq!(all.len(), 200);
}

fn ratios(values: Vec<Option<RatioValue>>) -> Ratios {
    let group = |name: &str, kind, values| RatioGroup { name: name.to_owned(), kind, values };
    let machines = (0..values.len()).map(|k| format!("machine {k} {ODD}")).collect();
    let groups = vec![
        group("grid-sap@gpu0", RatioKind::Algorithm, values.clone()),
        group("clock (MHz)", RatioKind::Parameter, values.clone()),
        group(ODD, RatioKind::Parameter, vec![None; values.len()]),
    ];
    Ratios { title: "Ratios".to_owned(), reference: ODD.to_owned(), machines, groups }
}

#[test]
fn ratios_are_beside_their_names_and_parameters_apart_from_algorithms() {
    let value = |ratio: f64| Some(RatioValue { ratio, low: Some(0.9 * ratio), high: Some(1.1 * ratio) });
    let figure = ratios(vec![value(0.5), None, value(3.0)]);
    let (svg, _) = drawn(&figure);
    let order =
        ["Hardware parameters", "clock (MHz)", "Algorithms", "grid-sap@gpu0"].map(|text| svg.find(text).unwrap());
    assert!(order.is_sorted(), "{order:?}");
    let needed = ["times the reference", "(the reference)", "no mark: a value is missing", ">\nmissing\n"];
    assert!(needed.iter().all(|text| svg.contains(text)), "{svg}");
    assert!((0..3).all(|k| svg.contains(&format!("machine {k} {ESCAPED}"))));
}

#[test]
fn any_ratios_are_drawn() {
    let value = |ratio, end: f64| Some(RatioValue { ratio, low: Some(end), high: Some(-end) });
    let awkward = AWKWARD.map(|ratio| value(ratio, f64::NAN)).into_iter().chain(AWKWARD.map(|end| value(2.0, end)));
    let mut short = ratios(vec![value(2.0, 1.0); 8]);
    short.groups[0].values.clear();
    short.groups.resize(40, short.groups[1].clone());
    for figure in [ratios(awkward.collect()), short] {
        assert!(!drawn(&figure).0.contains("no parameter and no algorithm"));
    }
    for figure in [Ratios::default(), ratios(Vec::new()), ratios(vec![None, value(f64::NAN, 1.0), value(0.0, 1.0)])] {
        assert!(drawn(&figure).0.contains("no parameter and no algorithm"));
    }
}

fn map(points: Vec<MapPoint>, grid: Vec<MapCell>) -> FieldMap {
    let names = (0..7).map(|k| (format!("field {k} {ODD}"), k)).collect();
    let panel = MapPanel { title: "measured".to_owned(), grid, points };
    let panels = vec![panel.clone(), MapPanel { title: "predicted".to_owned(), ..panel }];
    FieldMap {
        title: String::new(),
        names,
        x: (10.0, 1e5),
        y: (0.1, 10.0),
        y_name: "pairs per object".to_owned(),
        panels,
    }
}

#[test]
fn a_map_has_fields_points_and_rings() {
    let point = |loss| MapPoint { x: 100.0, y: 1.0, algorithm: 2, loss };
    let cell = |k: u32, j: u32| MapCell {
        x: (10.0 * f64::from(k + 1), 10.0 * f64::from(k + 2)),
        y: (f64::from(j + 1), f64::from(j + 2)),
        algorithm: usize::from(k > 2),
    };
    let grid: Vec<MapCell> = (0..6).flat_map(|k| (0..4).map(move |j| cell(k, j))).collect();
    let figure = map(vec![point(Some(0.05)), point(Some(0.2))], grid);
    let (svg, _) = drawn(&figure);
    let needed = ["measured", "predicted", "pairs per object", "regret over 10 %"];
    assert!(
        needed.iter().all(|text| svg.contains(text)) && (0..7).all(|k| svg.contains(&format!("field {k} {ESCAPED}")))
    );
    // The sign in the legend and a ring in each panel.
    assert_eq!((svg.matches(" r=\"9\"").count(), svg.matches(" r=\"7\"").count()), (2, 1), "{svg}");
    // Two fields that the grid is made of, and two points, in each of two panels.
    assert!(!drawn(&map(vec![point(None), point(Some(0.1))], Vec::new())).0.contains("regret over"));
}

#[test]
fn any_map_is_drawn() {
    let points = every_pair().into_iter().enumerate().map(|(k, (x, y))| MapPoint {
        x,
        y,
        algorithm: k % 9,
        loss: Some(AWKWARD[k % 10]),
    });
    let pairs = every_pair();
    let cell = |k: usize| MapCell { x: pairs[k % 100], y: pairs[k * 7 % 100], algorithm: k % 9 };
    let (points, grid): (Vec<_>, Vec<_>) = (points.collect(), (0..100).map(cell).collect());
    let ranges = [(f64::NAN, f64::INFINITY), (0.0, 0.0), (5.0, 5.0), (1e12, 1.0)];
    for x in ranges {
        drawn(&FieldMap { x, y: x, ..map(points.clone(), grid.clone()) });
    }
    for figure in [FieldMap::default(), map(Vec::new(), Vec::new())] {
        assert!(drawn(&figure).0.contains("no fields are known"));
    }
}

#[test]
fn a_matrix_tells_verdicts_by_sign_and_text() {
    let cell = |verdict, text: &str| InfluenceCell { verdict: Some(verdict), text: text.to_owned() };
    let cells = vec![
        vec![cell(Verdict::Linked, "-0.80"), cell(Verdict::NotLinked, "weak")],
        vec![cell(Verdict::CannotBeTold, "")],
    ];
    let names = |names: [&str; 2]| names.map(str::to_owned).to_vec();
    let columns = names(["sap@cpu1", ODD]);
    let figure = Influence { title: "Influence".to_owned(), columns, rows: names(["clock (MHz)", ODD]), cells };
    let (svg, _) = drawn(&figure);
    let needed =
        ["-0.80\n", "weak\n", "?\n", "clock (MHz)\n", "sap@cpu1\n", "not linked\n", "cannot be told", "absent"];
    assert!(needed.iter().all(|text| svg.contains(text)), "{svg}");
    assert_eq!(svg.matches(&format!("{ESCAPED}\n")).count(), 2);
    let long: Vec<String> = (0..60).map(|k| format!("crossover of algorithm number {k} and {ODD}").repeat(4)).collect();
    drawn(&Influence { columns: long.clone(), rows: long, ..figure.clone() });
    for figure in [Influence::default(), Influence { rows: Vec::new(), ..figure }] {
        assert!(drawn(&figure).0.contains("too few machines to tell"));
    }
}

fn crossovers(points: Vec<AgreementPoint>) -> Agreement {
    let groups = vec![AgreementGroup { name: format!("crossover {ODD}"), style: 2, points }];
    Agreement { title: "Crossovers".to_owned(), values: Values::CrossoversObjects, groups }
}

#[test]
fn predictions_are_drawn_where_both_values_are_known() {
    let point = |measured: f64, predicted| AgreementPoint {
        measured,
        predicted,
        interval: Some((0.8 * measured, 1.3 * measured)),
    };
    let (svg, _) = drawn(&crossovers(vec![point(100.0, 150.0), point(1e5, 3e4), point(f64::INFINITY, 10.0)]));
    let needed =
        ["measured crossover (objects)", "predicted crossover (objects)", "factor of two", "1 without a position"];
    assert!(needed.iter().all(|text| svg.contains(text)), "{svg}");
    assert_eq!(svg.matches(&format!("crossover {ESCAPED}")).count(), 1);
    let awkward: Vec<AgreementPoint> = every_pair().into_iter().map(|(a, b)| point(a, b)).collect();
    for points in [awkward.clone(), vec![point(7.0, 7.0)]] {
        assert!(!drawn(&crossovers(points)).0.contains("No crossover was both"));
    }
    for points in [Vec::new(), vec![point(f64::NAN, 1.0), point(1.0, 0.0)]] {
        assert!(drawn(&crossovers(points)).0.contains("No crossover was both"));
    }
    let many = (0..200).map(|style| AgreementGroup { style, ..crossovers(vec![point(7.0, 8.0)]).groups.remove(0) });
    drawn(&Agreement { groups: many.collect(), ..Agreement::default() });
}

#[test]
fn the_figures_of_a_training_stand_alone() {
    let points =
        every_pair().into_iter().map(|(measured, predicted)| AgreementPoint { measured, predicted, interval: None });
    let group = AgreementGroup { name: format!("sap {ODD}"), style: 3, points: points.collect() };
    let times = Agreement { title: "Times".to_owned(), values: Values::TimesNs, groups: vec![group] };
    let strategy = StrategyRegrets { name: format!("strategy {ODD}"), style: 1, regrets: AWKWARD.to_vec() };
    let regrets =
        Regrets { title: "Regrets".to_owned(), unit: "physical machine".to_owned(), strategies: vec![strategy] };
    let units = ["measured time of a frame (", "quantile over the held-out physical machines"];
    let figures: [&dyn Figure; 2] = [&times, &regrets];
    for (figure, unit) in figures.into_iter().zip(units) {
        let svg = drawn(figure).0;
        assert!(svg.contains(unit) && svg.contains(figure.title()) && svg.contains(ESCAPED), "{svg}");
    }
    let svg = drawn(&TrainingPicture { times, regrets }).0;
    assert!(units.iter().chain(&["Times\n", "Regrets\n"]).all(|text| svg.contains(text)), "{svg}");
    let empty: [&dyn Figure; 3] = [&Agreement::default(), &Regrets::default(), &TrainingPicture::default()];
    for figure in empty {
        assert!(drawn(figure).0.contains("there is one report only"));
    }
}
