//! Writes a drawing as SVG, with one style sheet and colors for light and dark pages.

use std::fmt::Write as _;

use ivcam_base::files::escaped;

use super::drawing::{Anchor, Drawing, DrawingOutput, DrawingText, Ink, Lettering, Path};

/// The colors can be distinguished by people who confuse red and green (after Okabe and Ito).
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

impl Drawing {
    /// Returns the drawing as an SVG file.
    pub fn to_svg(&self) -> String {
        let (w, h) = (short(self.width), short(self.height));
        let mut svg = Svg(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" \
             height=\"{h}\">\n<style>{STYLE}</style>\n<rect class=\"bg\" width=\"{w}\" height=\"{h}\"/>\n",
        ));
        self.draw(&mut svg);
        svg.0 + "</svg>\n"
    }
}

/// The text of the file.
struct Svg(String);

impl Svg {
    fn element(&mut self, element: std::fmt::Arguments<'_>) {
        let _ = self.0.write_fmt(element);
        self.0.push('\n');
    }
}

impl DrawingOutput for Svg {
    fn path(&mut self, path: &Path) {
        let mut d = String::new();
        for (i, [x, y]) in path.points.iter().enumerate() {
            let letter = if i == 0 { "M" } else { "L" };
            let _ = write!(d, "{letter}{} {}", short(*x), short(*y));
        }
        let end = if path.closed { "Z" } else { "" };
        let dash = if path.dashed { " d" } else { "" };
        let class = class(path.ink);
        self.element(format_args!(
            "<path class=\"{class}{dash}\" d=\"{d}{end}\"/>"
        ));
    }

    fn dot(&mut self, [x, y]: [f64; 2], radius: f64, ink: Ink) {
        let (x, y, r) = (short(x), short(y), short(radius));
        let class = class(ink);
        self.element(format_args!(
            "<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"{r}\"/>"
        ));
    }

    fn dots(&mut self, places: &[[f64; 2]], radius: f64, ink: Ink) {
        // A stroke of length 0 with round ends is a dot.
        let dot = |[x, y]: &[f64; 2]| format!("M{} {}h0", short(*x), short(*y));
        let d: String = places.iter().map(dot).collect();
        let (class, width) = (class(ink), short(2.0 * radius));
        self.element(format_args!(
            "<path class=\"{class}\" style=\"stroke-width:{width}\" d=\"{d}\"/>"
        ));
    }

    fn cross(&mut self, [x, y]: [f64; 2], size: f64, ink: Ink) {
        let [a, b, c, d] = [(-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)]
            .map(|(a, b)| format!("{} {}", short(x + a * size), short(y + b * size)));
        // A cross has the style of a ray that is not lost.
        let class = class(ink).replace('l', "r");
        self.element(format_args!(
            "<path class=\"{class}\" d=\"M{a}L{b}M{c}L{d}\"/>"
        ));
    }

    fn text(&mut self, text: &DrawingText) {
        let anchor = match text.anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let faint = (text.ink == Ink::Faint).then_some("f");
        let set = match text.lettering {
            Lettering::Plain => None,
            Lettering::Italic => Some("i"),
            Lettering::Bold => Some("b"),
        };
        let classes: Vec<&str> = faint.into_iter().chain(set).collect();
        let class = match classes.is_empty() {
            true => String::new(),
            false => format!(" class=\"{}\"", classes.join(" ")),
        };
        let ([x, y], size) = (text.at.map(short), short(text.size));
        let words = escaped(&text.words);
        self.element(format_args!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\"{anchor}{class}>{words}</text>"
        ));
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

/// Formats a number with at most two decimals.
fn short(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}
