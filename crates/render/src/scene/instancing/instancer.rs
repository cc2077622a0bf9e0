//! A visitor that records prototypes and places them.

use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::{Grid, Instance, State, Visitor, walk_part};

use super::prototypes::{Outcome, Prototypes};

/// A visitor that stores the repeated parts of a scene once.
pub(in crate::scene) trait Instancer<'a>: Visitor<'a> + Sized {
    /// What the visitor has collected outside of the part that is being recorded.
    type Outside;

    /// The prototypes of the scene, or `None` if everything is expanded.
    fn prototypes(&mut self) -> Option<&mut Prototypes<'a>>;

    /// Begins to record a part, whose walk begins with a state.
    fn begin_prototype(&mut self, state: &mut State<'a>) -> Self::Outside;

    /// Ends a recording, and continues with what was collected before. Returns the number of the
    /// prototype, or `None` if the part cannot be one, which is the case if `is_spoiled`.
    fn end_prototype(&mut self, outside: Self::Outside, is_spoiled: bool) -> Option<u32>;

    /// Places a prototype at a state's matrix, once or at every place of a grid. Returns `false` if
    /// it is to be expanded there.
    fn place(&mut self, prototype: u32, grid: Option<Grid>, state: &State<'a>) -> bool;

    /// Receives the node of the part that a new prototype was recorded from.
    fn stands_for(&mut self, _prototype: u32, _node: NodeRef<'a>) {}
}

/// Draws an instance of a part, which is recorded at its first instance. Returns `false` if the
/// walk is to enter the part.
pub(in crate::scene) fn draw_instance<'a, V: Instancer<'a>>(
    visitor: &mut V,
    part: Instance<'a>,
    state: &State<'a>,
) -> bool {
    let outcome = visitor.prototypes().map(|all| all.find(part, state));
    let outcome = match outcome {
        Some(None) => record(visitor, part, state),
        known => known.flatten(),
    };
    match outcome {
        Some(Outcome::Prototype(number)) => visitor.place(number, part.grid(), state),
        _ => false,
    }
}

/// Records a part by a walk of its own.
fn record<'a, V: Instancer<'a>>(
    visitor: &mut V,
    part: Instance<'a>,
    state: &State<'a>,
) -> Option<Outcome> {
    let (mut inner, mut walk) = visitor.prototypes()?.begin(part, state);
    let outside = visitor.begin_prototype(&mut inner);
    let memory = (&walk.options, &mut walk.scratch);
    walk_part(walk.snapshot, part, inner, memory, visitor);
    let is_spoiled = visitor.prototypes()?.end(walk);
    let number = visitor.end_prototype(outside, is_spoiled);
    if let Some(number) = number {
        visitor.stands_for(number, part.node());
    }
    Some(visitor.prototypes()?.keep(part, state, number))
}
