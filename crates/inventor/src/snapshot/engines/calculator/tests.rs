use glam::DVec3;

use super::parse::parse;
use super::program::Bank;

fn run(text: &str) -> Result<Bank, String> {
    let mut bank = Bank::default();
    bank.scalars[0] = [2.0, 3.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0];
    bank.vectors[0][0] = DVec3::new(1.0, 2.0, 3.0);
    for statement in parse(text)? {
        statement.run(&mut bank)?;
    }
    Ok(bank)
}

fn oa(text: &str) -> f64 {
    run(text).unwrap().scalars[2][0]
}

#[test]
fn operators_bind_as_in_c() {
    assert_eq!(oa("oa = a + b * 2"), 8.0);
    assert_eq!(oa("oa = (a + b) * 2 - -1"), 11.0);
    assert_eq!(oa("oa = a - b - 1"), -2.0);
    assert_eq!(oa("oa = 7 % 4"), 3.0);
    assert_eq!(oa("oa = a < b && !(a == 2) || c >= .5"), 1.0);
    assert_eq!(oa("oa = a > b ? 1 : c > 1 ? 2 : 3"), 3.0);
    assert_eq!(oa("oa = -A[1] + 1"), -1.0);
}

#[test]
fn vectors_have_components_and_products() {
    let bank = run(
        "oA = 2 * A + vec3f(a, 0, 1e1); oB[1] = A[2]; oa = dot(A, A); ob = length(cross(A, A))",
    )
    .unwrap();
    assert_eq!(bank.vectors[2][0], DVec3::new(4.0, 4.0, 16.0));
    assert_eq!(bank.vectors[2][1], DVec3::new(0.0, 3.0, 0.0));
    assert_eq!((bank.scalars[2][0], bank.scalars[2][1]), (14.0, 0.0));
}

#[test]
fn functions_constants_and_temporaries() {
    assert_eq!(
        oa("ta = M_PI / 2; oa = sin(ta) + atan2(0, 1) + pow(a, b)"),
        9.0
    );
    assert_eq!(
        oa("oa = floor(2.7) + ceil(0.1) + fabs(-4) + fmod(7, 4)"),
        10.0
    );
    let (once, again) = (oa("oa = rand(5)"), oa("oa = rand(5)"));
    assert!(once == again && (0.0..5.0).contains(&once));
}

#[test]
fn mistakes_are_sentences() {
    for (text, part) in [
        ("oa = ", "missing at the end"),
        ("a = 1", "cannot be assigned"),
        ("oa = A", "expected a number"),
        ("oA = 1", "expected a vector"),
        ("oa = q", "no variable `q`"),
        ("oa = foo(1)", "no function `foo`"),
        ("oa = pow(1)", "takes 2 values"),
        ("oa = A[3]", "components 0 to 2"),
        ("oa = (1", "`)` is missing"),
        ("oa = 1 2", "not understood"),
        ("oa = 1..2", "not understood"),
        ("oa = A * A", "wrong kind"),
    ] {
        let error = run(text).map(|_| ()).unwrap_err();
        assert!(error.contains(part), "{text}: {error}");
    }
    let deep = format!("oa = {}1", "(".repeat(100_000));
    assert!(run(&deep).is_err());
    let long = format!("oa = 1{}", "+1".repeat(100_000));
    assert!(run(&long).is_err());
    let signs = format!("oa = {}1", "-".repeat(100_000));
    assert!(run(&signs).is_err());
}

proptest::proptest! {
    #[test]
    fn no_text_breaks_the_language(text in "(oa|tA|oB|A|b|\\[|\\]|=|\\?|:|;|\\(|\\)|,|[-+*/%!<>&|.]|1|2e3|cos|vec3f|rand| ){0,24}") {
        let _ = run(&text);
    }
}
