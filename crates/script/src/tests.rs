use std::sync::Arc;

use ivcam_base::diag::ErrorKind;
use ivcam_inventor::events::SnapshotOptions;
use ivcam_inventor::iv::{Document, Limits, NoFiles, Value};
use ivcam_inventor::snapshot::{NoBounds, Snapshot};

use super::JavaScript;
use super::guard::{GROW, guarded, pattern_fits};

/// Returns the document at time 0, after its scripts were initialized.
fn play(document: &Document) -> Document {
    let options = SnapshotOptions {
        scripts: Some(&JavaScript),
        ..SnapshotOptions::default()
    };
    Snapshot::take(document, &options, &NoBounds)
        .document()
        .clone()
}

fn read(scene: &str) -> Document {
    let bytes = format!("#VRML V2.0 utf8\n{scene}").into_bytes();
    Document::read("test.wrl", bytes, Arc::new(NoFiles), &Limits::default()).expect("reads")
}

/// Returns the messages of a scene with one script, whose text contains no double quotes.
fn messages(program: &str) -> Vec<(ErrorKind, String)> {
    let scene = format!(
        "DEF Clock TimeSensor {{ loop TRUE }}
         DEF S Script {{ directOutput TRUE eventIn SFTime tick field MFInt32 list [ ]
           field SFNode self Group {{ }} url \"javascript: {program}\" }}
         ROUTE Clock.time TO S.tick"
    );
    played(&scene)
}

/// Returns the messages of a scene that is played at time 0.
fn played(scene: &str) -> Vec<(ErrorKind, String)> {
    let played = play(&read(scene));
    let items = played.sink.items().iter();
    items.map(|d| (d.kind, d.message.clone())).collect()
}

/// Asserts that a program reaches a limit, once, and that the message says which.
#[track_caller]
fn reaches(program: &str, limit: &str) {
    let said = messages(program);
    let reached: Vec<_> = said
        .iter()
        .filter(|(kind, _)| *kind == ErrorKind::Limit)
        .collect();
    assert!(
        reached.len() == 1 && reached[0].1.contains(limit),
        "{program}: {said:?}"
    );
}

#[test]
fn endless_work_ends_at_the_limit_of_instructions() {
    for program in [
        "while (true);",
        "function initialize() { for (;;) list[0] = 1; }",
        "function initialize() { while (true) try { while (true); } catch (e) { } }",
        "function f(n) { if (n > 0) for (var i = 0; i < 99; i++) f(n - 1); } function initialize() { f(9); }",
        "function initialize() { [2, 1].sort(function () { while (true); }); }",
        "function initialize() { var o = { valueOf: function () { while (true); } }; o + 1; }",
        "function tick() { do { } while (1); }",
    ] {
        reaches(program, "instructions");
    }
}

#[test]
fn endless_recursion_ends_at_the_limit_of_depth() {
    reaches(
        "function f() { f(); } function initialize() { f(); }",
        "deep",
    );
    let quietly = "function f() { try { f(); } finally { f(); } } function initialize() { f(); }";
    reaches(quietly, "deep");
    let converts = "function f() { return '' + { toString: f }; } function initialize() { f(); }";
    reaches(converts, "deep");
}

#[test]
fn strings_that_grow_end_at_a_limit() {
    for (program, limit) in [
        (
            "var s = 'ab'; function initialize() { for (;;) s += s; }",
            "longer than",
        ),
        (
            "var s = 'ab'; function initialize() { for (;;) s = s + s; }",
            "longer than",
        ),
        (
            "var s = 'ab'; function initialize() { for (;;) s = `${s}${s}`; }",
            "longer than",
        ),
        (
            "var s = 'ab'; function initialize() { for (;;) s = s.concat(s); }",
            "longer than",
        ),
        (
            "var s = 'ab'; function initialize() { for (;;) s = [s, s].join(''); }",
            "longer than",
        ),
        (
            "var s = 'ab'; function initialize() { for (;;) s = s.replace(/a/g, '$&$&b'); }",
            "longer than",
        ),
        ("function initialize() { 'ab'.repeat(1e9); }", "longer than"),
        ("function initialize() { 'ab'.padEnd(1e9); }", "longer than"),
        (
            "var s = 'ab', a = []; while (s.length < 1e6) s += s;
          function initialize() { for (var i = 0; ; i++) a.push(s + i); }",
            "characters",
        ),
    ] {
        reaches(program, limit);
    }
}

#[test]
fn lists_that_grow_end_at_a_limit() {
    for (program, limit) in [
        (
            "function initialize() { list.length = 1e9; }",
            "list of more than",
        ),
        (
            "function initialize() { list[1e9] = 1; }",
            "list of more than",
        ),
        (
            "function initialize() { new Array(1e9).join('x'); }",
            "elements",
        ),
        (
            "function initialize() { new Array(1e9).fill(0); }",
            "elements",
        ),
        (
            "function initialize() { Array.from({ length: 1e9 }); }",
            "elements",
        ),
        (
            "function initialize() { Math.max.apply(null, { length: 1e9 }); }",
            "elements",
        ),
        (
            "var a = [1]; function initialize() { for (;;) a = a.concat(a); }",
            "elements",
        ),
        (
            "var a = [1]; for (var i = 0; i < 99; i++) a = [a, a];
          function initialize() { '' + a; }",
            "",
        ),
        (
            "var a = []; function initialize() { for (;;) a.push({ }); }",
            "instructions",
        ),
    ] {
        reaches(program, limit);
    }
}

#[test]
fn nodes_that_are_created_without_end_end_at_a_limit() {
    let often = "function initialize() { for (;;) Browser.createVrmlFromString('Group { }'); }";
    reaches(often, "create nodes more than");
    let many = "function initialize() {
        var s = 'Group { }'; for (var i = 0; i < 19; i++) s += s;
        Browser.createVrmlFromString(s); }";
    reaches(many, "nodes");
    let protos = "function initialize() { var s = 'PROTO P0 [ ] { Group { } }';
        for (var i = 0; i < 40; i++)
          s += 'PROTO P' + (i + 1) + ' [ ] { Group { children [ P' + i + ' { } P' + i + ' { } ] } }';
        Browser.createVrmlFromString(s + 'P40 { }'); }";
    reaches(protos, "nodes");
}

/// Preparing a script counts as instructions of the scene.
#[test]
fn scripts_that_a_script_creates_end_at_a_limit() {
    let scene = "DEF S Script { directOutput TRUE
        url \"javascript: function initialize() {
          var q = String.fromCharCode(34);
          var inner = 'Script { url ' + q + 'javascript: function initialize() { }' + q + ' }';
          for (var i = 0; i < 30; i++) Browser.createVrmlFromString(inner); }\" }";
    let said: Vec<_> = played(scene).into_iter().map(|(_, m)| m).collect();
    assert_eq!(
        said,
        ["all scripts stopped: the scene's scripts execute more than 1000000 instructions"]
    );
}

#[test]
fn a_scene_runs_a_limited_number_of_scripts() {
    let script = "Script { url \"javascript: function initialize() { }\" } ";
    let said: Vec<_> = played(&script.repeat(30))
        .into_iter()
        .map(|(_, m)| m)
        .collect();
    assert_eq!(
        said,
        ["the scene has more than 20 scripts; the rest is not run"]
    );
}

#[test]
fn programs_that_nest_too_deep_are_refused() {
    for (open, middle, close) in [
        ("(", "1", ")"),
        ("[", "1", "]"),
        ("!", "1", ""),
        ("x = ", "1", ""),
        ("1 + ", "1", ""),
        ("if (1) ", ";", ""),
        ("if (1) { } else ", ";", ""),
        ("a ? b : ", "1", ""),
        ("{", "1", "}"),
        ("new ", "f", ""),
        ("x => ", "1", ""),
        ("f(", "1", ")"),
    ] {
        let program = open.repeat(20_000) + middle + &close.repeat(20_000);
        let said = messages(&program);
        assert!(
            said.iter().any(|(_, m)| m.contains("nests too deep")),
            "{open}: {said:?}"
        );
    }
}

#[test]
fn a_regular_expression_that_repeats_repetitions_is_refused() {
    for (pattern, length, fits) in [
        ("a+b*", 400, true),
        ("(ab)+c", 400, true),
        ("[a-z]+@[a-z]+", 400, true),
        ("(a+)+$", 40, false),
        ("((a|b))*c", 40, false),
        ("(a*){2,}", 40, false),
        ("a*a*a*a*b", 1_000, false),
        ("a{2}", 1_000, true),
    ] {
        assert_eq!(pattern_fits(pattern, length).is_ok(), fits, "{pattern}");
    }
    let said = messages("function initialize() { /(a+)+$/.test('aaaa'); }");
    assert!(said[0].1.contains("regular expression"), "{said:?}");
    reaches(
        "function initialize() { new RegExp('(a+)+$').test('aaaa'); }",
        "regular expression",
    );
}

#[test]
fn a_script_sees_nothing_outside_its_scene() {
    let program = "function initialize() {
        print([typeof process, typeof require, typeof fetch, typeof Promise, typeof Proxy, typeof Reflect,
          typeof setTimeout, typeof SharedArrayBuffer].join(' '));
        try { new Function('return 1')(); print('made'); } catch (e) { print('refused'); }
        try { (function () { }).constructor('return 1')(); print('made'); } catch (e) { print('refused'); } }";
    let said: Vec<String> = messages(program).into_iter().map(|(_, m)| m).collect();
    assert_eq!(
        said,
        [
            format!("a script prints:{}", " undefined".repeat(8)),
            "a script prints: refused".to_owned()
        ]
    );
}

#[test]
fn a_storm_of_events_between_scripts_ends() {
    let scene = "DEF A Script { eventIn SFInt32 go field SFNode other DEF B Script {
          eventIn SFInt32 go field SFNode other Group { } directOutput TRUE
          url \"javascript: function go(v) { }\" } directOutput TRUE
        url \"javascript: function go(v) { } function initialize() { for (;;) other.go = 1; }\" }";
    let said: Vec<_> = played(scene).into_iter().map(|(_, m)| m).collect();
    assert!(said.iter().any(|m| m.contains("instructions")), "{said:?}");
}

#[test]
fn strings_are_measured_and_the_program_stays_the_same_otherwise() {
    for (program, calls) in [
        ("1 + 2", 0),
        ("a + 1", 1),
        ("a + b + c", 2),
        ("x = (a + b) * (i - 1 + 2)", 1),
        ("x.y[i++] += 'é' + f(a + b)", 3),
        ("var f = x => x + 'b';", 1),
        (
            "function f(a, b) {\r\n  // a + b\r\n  return a +\r\n b; }",
            1,
        ),
        ("`a${b + c}d`", 2),
        ("for (var i = 0; i < 9; i += 1) ;", 1),
        ("a + b ? c + d : e + f", 3),
        ("s = 'a + b'; r = /a + b/;", 0),
        ("o = { a: b + c, 'd': e }; new F(a + b).c[d + e](f)", 3),
        ("f(a)(b).c + g[h[i]] /* ] */ [j /* ] */ ] + 'x'", 2),
        (
            "x += a[b]; y += new C; z += new C(1); w += -a[b]; v += i++ + a[i]++",
            5,
        ),
        ("x = a + function () { return b + c; }", 2),
        ("f().x += 'a'; f()[g()] += ++a[i]; i = j++ + 'k'", 3),
        ("var a = (b, c + d), e = [f + g, h + i];", 3),
        ("s += t ? 'u' : v[w]; if (a + b) c + d\nelse e += f", 4),
    ] {
        let text = guarded(program).unwrap_or_else(|e| panic!("{program}: {e}"));
        assert_eq!(text.matches(GROW).count(), calls, "{text}");
        assert!(guarded(&text).is_ok(), "{program} becomes {text}");
        let lines = |text: &str| text.matches('\n').count();
        assert_eq!(lines(&text), lines(program), "{text}");
    }
    assert_eq!(guarded("a + b").unwrap(), format!("{GROW}(a + b)"));
}

#[test]
fn an_engines_fault_or_an_unknown_value_leaves_the_scene_as_it_is() {
    let scene = "DEF M Material { transparency 0.5 } DEF S Script { eventOut SFFloat out eventOut MFVec3f many
        url \"javascript: function initialize() { out = NaN; many = 'x'; many[0] = Infinity; }\" }
        ROUTE S.out TO M.set_transparency";
    let document = read(scene);
    let played = play(&document);
    let value = played
        .node(played.names["M"])
        .value("transparency")
        .cloned();
    assert_eq!(value, Some(Value::Float(0.0)));
}
