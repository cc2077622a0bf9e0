//! Adds nodes of X3D for files of other formats.

use glam::{Vec2, Vec3};
use ivcam_base::diag::{Diagnostic, Result, Span};

use crate::grammar::value::{NodeId, Value};
use crate::grammar::{ClassId, Field, appearance, class, texture_coordinate, vrml97_shape};
use crate::iv::document::ClassRef;
use crate::iv::read::assemble::Assembler;

/// Adds nodes to the document of an assembler.
pub(super) struct Builder<'a, 'd> {
    pub(super) asm: &'a mut Assembler<'d>,
}

impl Builder<'_, '_> {
    /// Adds a node.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn node(&mut self, class: ClassId, span: Span) -> Result<NodeId> {
        self.asm.add(ClassRef::Known(class), None, span)
    }

    /// Sets a field of a node.
    pub(super) fn set<T: ?Sized>(&mut self, node: NodeId, field: Field<T>, value: Value) {
        let data = &self.asm.document.nodes[node.0 as usize];
        let (ClassRef::Known(class), span) = (data.class, data.span) else {
            return;
        };
        if let Some((index, _)) = class.get().field(field.decl().name) {
            self.asm.set(node, index as u16, value, span);
        }
    }

    /// Adds a node with one field.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn with<T: ?Sized>(
        &mut self,
        class: ClassId,
        field: Field<T>,
        value: Value,
        span: Span,
    ) -> Result<NodeId> {
        let node = self.node(class, span)?;
        self.set(node, field, value);
        Ok(node)
    }

    /// Adds texture coordinates.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn texture_coordinates(&mut self, list: Vec<Vec2>, span: Span) -> Result<NodeId> {
        let list = Value::Vec2s(list);
        self.with(
            class::TEXTURE_COORDINATE,
            texture_coordinate::POINT,
            list,
            span,
        )
    }

    /// Names a node.
    pub(super) fn name(&mut self, node: NodeId, name: &str) {
        let legal = |c: char| match c {
            '\0'..=' ' | ',' | '{' | '}' | '[' | ']' | '"' | '#' | '\'' | '.' | '+' => '_',
            c => c,
        };
        let legal: String = name.chars().map(legal).collect();
        if !legal.is_empty() {
            self.asm.define(legal.as_bytes(), node);
            self.asm.complete(node);
        }
    }

    /// Adds a `Shape`.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn shape(
        &mut self,
        appearance: NodeId,
        geometry: NodeId,
        span: Span,
    ) -> Result<NodeId> {
        let shape = self.node(class::VRML97_SHAPE, span)?;
        self.set(
            shape,
            vrml97_shape::APPEARANCE,
            Value::Node(Some(appearance)),
        );
        self.set(shape, vrml97_shape::GEOMETRY, Value::Node(Some(geometry)));
        Ok(shape)
    }

    /// Adds an `Appearance` with X3D's default material.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn plain_appearance(&mut self) -> Result<NodeId> {
        let material = self.node(class::VRML97_MATERIAL, Span::default())?;
        let value = Value::Node(Some(material));
        self.with(
            class::APPEARANCE,
            appearance::MATERIAL,
            value,
            Span::default(),
        )
    }

    /// Adds a `Shape` of lines or points, which are white unless they have colors.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn unlit_shape(&mut self, geometry: NodeId, span: Span) -> Result<NodeId> {
        self.with(
            class::VRML97_SHAPE,
            vrml97_shape::GEOMETRY,
            Value::Node(Some(geometry)),
            span,
        )
    }

    /// Adds a warning.
    pub(super) fn warn(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.asm.document.sink.warn(span, message)
    }

    /// Adds a warning that the file is damaged.
    pub(super) fn damage(&mut self, span: Span, message: impl Into<String>) -> &mut Diagnostic {
        self.asm.document.sink.damage(span, message)
    }
}

/// Returns a color, of which values that are not finite are 0.
pub(super) fn color(numbers: [f32; 3]) -> Vec3 {
    Vec3::from_array(numbers.map(|n| if n.is_finite() { n } else { 0.0 }))
}
