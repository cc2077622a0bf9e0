//! What engines give out: values by name, and the pulses of triggers.

use crate::iv::Value;

/// How often a trigger has fired by now, and when it last did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pulses {
    pub count: u64,
    pub last: f64,
}

/// Values by the names of an engine's outputs.
pub(super) type Outputs = Vec<(&'static str, Value)>;
