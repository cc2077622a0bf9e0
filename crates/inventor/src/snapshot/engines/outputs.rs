//! The outputs of engines: values by name, and the pulses of triggers.

use crate::iv::Value;

/// The pulses of a trigger up to the present time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pulses {
    /// The number of pulses.
    pub count: u64,
    /// The time of the last pulse, in seconds.
    pub last: f64,
}

/// The names and values of an engine's outputs.
pub(super) type Outputs = Vec<(&'static str, Value)>;
