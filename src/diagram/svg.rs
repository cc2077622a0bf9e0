//! A drawing as SVG: thin lines, one style sheet, colours for light and dark pages.

use std::fmt::Write as _;

use super::{Anchor, Drawing, Ink, Item};

/// Colours are chosen to be told apart by eyes that confuse red and green (after Okabe and Ito).
const STYLE: &str = "
text{font-family:'Helvetica Neue',Helvetica,Arial,'Liberation Sans','DejaVu Sans',sans-serif;fill:#1c2227}
text.f{fill:#68737c}
text.i{font-family:Georgia,'Times New Roman','Liberation Serif','DejaVu Serif',serif;font-style:italic}
text.b{font-weight:600}
path{fill:none;stroke-width:.7;stroke-linejoin:round;stroke-linecap:round}
.bg{fill:#fff}
.d{stroke-dasharray:3 2.4}
.ax{stroke:#9aa5ad;stroke-width:.5;stroke-dasharray:9 2 1.5 2}
.g0,.g1,.g2,.g3{stroke:#40566b;stroke-width:.7}
.g0{fill:#e9f2f8}.g1{fill:#dbe8f1}.g2{fill:#cbdbe6}.g3{fill:#b8ccda}
.st{stroke:#1c2227;stroke-width:1.8;stroke-linecap:butt}
.fi{stroke:#1c2227;stroke-width:1.2;stroke-linecap:butt}
.r0{stroke:#0072b2}.r1{stroke:#009e73}.r2{stroke:#d55e00}.r3{stroke:#a0528e}
.l0,.l1,.l2,.l3{stroke-dasharray:2 2;opacity:.6}
.l0{stroke:#0072b2}.l1{stroke:#009e73}.l2{stroke:#d55e00}.l3{stroke:#a0528e}
.r0,.r1,.r2,.r3,.l0,.l1,.l2,.l3{stroke-width:.55}
.pl{stroke:#68737c;stroke-width:.6;stroke-dasharray:4 2.5}
.mk{fill:#1c2227}
.la{stroke:#1c2227;stroke-width:.8}
.fa{stroke:#c3cbd1;stroke-width:.5}
.c0{stroke:#1c2227}.c1{stroke:#0072b2}.c2{stroke:#d55e00}.c3{stroke:#009e73}.c4{stroke:#a0528e}
.c0,.c1,.c2,.c3,.c4{stroke-width:1.1}
circle{stroke:none}
circle.c0{fill:#1c2227}circle.c1{fill:#0072b2}circle.c2{fill:#d55e00}circle.c3{fill:#009e73}circle.c4{fill:#a0528e}
circle.fa{fill:#c3cbd1}
@media (prefers-color-scheme:dark){
text{fill:#e6eaed}text.f{fill:#98a4ad}.bg{fill:#14181b}
.ax{stroke:#5b666e}.g0,.g1,.g2,.g3{stroke:#9db6ca}
.g0{fill:#1f2b34}.g1{fill:#25343f}.g2{fill:#2c3e4b}.g3{fill:#344959}
.st,.fi,.la,.c0{stroke:#e6eaed}.mk,circle.c0{fill:#e6eaed}.pl{stroke:#98a4ad}.fa{stroke:#3b444b}circle.fa{fill:#3b444b}
.r0,.l0,.c1{stroke:#56b4e9}.r1,.l1,.c3{stroke:#2fc79a}.r2,.l2,.c2{stroke:#f28a3c}.r3,.l3,.c4{stroke:#cc79a7}
circle.c1{fill:#56b4e9}circle.c2{fill:#f28a3c}circle.c3{fill:#2fc79a}circle.c4{fill:#cc79a7}
}
";

pub fn write(drawing: &Drawing) -> String {
    let (w, h) = (drawing.width, drawing.height);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" \
         height=\"{1}\">\n<style>{STYLE}</style>\n<rect class=\"bg\" width=\"{0}\" height=\"{1}\"/>\n",
        short(w),
        short(h)
    );
    for item in &drawing.items {
        put(&mut text, item);
    }
    text += "</svg>\n";
    text
}

fn put(text: &mut String, item: &Item) {
    match item {
        Item::Path {
            points,
            closed,
            ink,
            dashed,
        } => {
            let mut d = String::new();
            for (i, [x, y]) in points.iter().enumerate() {
                let _ = write!(
                    d,
                    "{}{} {}",
                    if i == 0 { "M" } else { "L" },
                    short(*x),
                    short(*y)
                );
            }
            let end = if *closed { "Z" } else { "" };
            let dash = if *dashed { " d" } else { "" };
            let _ = writeln!(
                text,
                "<path class=\"{}{dash}\" d=\"{d}{end}\"/>",
                class(*ink)
            );
        }
        Item::Dot {
            at: [x, y],
            radius,
            ink,
        } => {
            let (x, y, r) = (short(*x), short(*y), short(*radius));
            let _ = writeln!(
                text,
                "<circle class=\"{}\" cx=\"{x}\" cy=\"{y}\" r=\"{r}\"/>",
                class(*ink)
            );
        }
        Item::Dots {
            places,
            radius,
            ink,
        } => {
            // Strokes of no length with round ends.
            let dot = |[x, y]: &[f64; 2]| format!("M{} {}h0", short(*x), short(*y));
            let d: String = places.iter().map(dot).collect();
            let class = class(*ink);
            let width = short(2.0 * radius);
            let _ = writeln!(
                text,
                "<path class=\"{class}\" style=\"stroke-width:{width}\" d=\"{d}\"/>"
            );
        }
        Item::Cross {
            at: [x, y],
            size,
            ink,
        } => {
            let d = [(-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)]
                .map(|(a, b)| format!("{} {}", short(x + a * size), short(y + b * size)));
            let class = class(*ink).replace('l', "r");
            let _ = writeln!(
                text,
                "<path class=\"{class}\" d=\"M{}L{}M{}L{}\"/>",
                d[0], d[1], d[2], d[3]
            );
        }
        Item::Text {
            at: [x, y],
            anchor,
            size,
            italic,
            bold,
            ink,
            text: words,
        } => {
            let anchor = match anchor {
                Anchor::Start => "",
                Anchor::Middle => " text-anchor=\"middle\"",
                Anchor::End => " text-anchor=\"end\"",
            };
            let mut classes = Vec::new();
            classes.extend((*ink == Ink::Faint).then_some("f"));
            classes.extend(italic.then_some("i"));
            classes.extend(bold.then_some("b"));
            let class = match classes.join(" ") {
                none if none.is_empty() => none,
                some => format!(" class=\"{some}\""),
            };
            let _ = writeln!(
                text,
                "<text x=\"{}\" y=\"{}\" font-size=\"{}\"{anchor}{class}>{}</text>",
                short(*x),
                short(*y),
                short(*size),
                escaped(words)
            );
        }
    }
}

fn class(ink: Ink) -> String {
    match ink {
        Ink::Axis => "ax".into(),
        Ink::Glass(n) => format!("g{}", n.min(3)),
        Ink::Stop => "st".into(),
        Ink::Film => "fi".into(),
        Ink::Ray(n) => format!("r{}", n % 4),
        Ink::Lost(n) => format!("l{}", n % 4),
        Ink::Plane => "pl".into(),
        Ink::Mark => "mk".into(),
        Ink::Label => "la".into(),
        Ink::Faint => "fa".into(),
        Ink::Curve(n) => format!("c{}", n % 5),
    }
}

/// Two places are a hundredth of a pixel.
fn short(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
