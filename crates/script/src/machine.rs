//! One script with its own context of the JavaScript engine.

use std::cell::RefCell;
use std::fmt;
use std::rc::Rc;

use boa_engine::context::ContextBuilder;
use boa_engine::context::HostHooks;
use boa_engine::context::time::{Clock, JsInstant};
use boa_engine::object::builtins::JsArray;
use boa_engine::realm::Realm;
use boa_engine::{
    Context, EngineError, JsError, JsNativeError, JsObject, JsResult, JsString, JsValue,
    RuntimeLimitError, Source, js_string,
};
use ivcam_inventor::events::{Event, World, script_input};
use ivcam_inventor::grammar::FieldType;
use ivcam_inventor::iv::declarations::{Access, Interface};
use ivcam_inventor::iv::{ClassRef, NodeRef, Value};
use ivcam_inventor::snapshot::engines::convert::to_type;

use super::guard::guarded;
use super::host::{Host, host_object};
use super::meter::Meter;
use super::values::{from_data, items, script_type, text, to_data};

const PRELUDE: &str = include_str!("prelude.js");

/// The deepest recursion of a script's functions, and the number of values on its stack.
const MAX_RECURSION: usize = 400;
const MAX_STACK: usize = 100_000;

/// Why a call ended early.
#[derive(Debug)]
pub(super) enum ScriptFailure {
    /// The script made an error, which ends only this call.
    Error(String),
    /// A limit was reached, which ends the script.
    Limit(String),
}

/// A script that runs.
pub(super) struct Machine {
    context: Context,
    /// The object that `prelude.js` returns.
    api: JsObject,
    interface: Vec<Interface>,
    meter: Rc<Meter>,
}

impl fmt::Debug for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let interface = &self.interface;
        f.debug_struct("Machine")
            .field("interface", interface)
            .finish_non_exhaustive()
    }
}

/// The time of the scene, counted from 1970 as the time stamps of events are.
struct SceneClock(Rc<RefCell<World>>);

impl Clock for SceneClock {
    fn now(&self) -> JsInstant {
        JsInstant::new(self.0.borrow().now.clamp(0.0, 1e9) as u64, 0)
    }

    fn system_time_millis(&self) -> i64 {
        (1e3 * self.0.borrow().now) as i64
    }
}

/// Keeps the machine's time zone out, and programs that are not guarded.
struct Hooks;

impl HostHooks for Hooks {
    fn ensure_can_compile_strings(
        &self,
        _: Realm,
        _: &[JsString],
        _: &JsString,
        _: bool,
        _: &mut Context,
    ) -> JsResult<()> {
        let error = JsNativeError::typ().with_message("functions cannot be made from text");
        Err(error.into())
    }

    fn local_timezone_offset_seconds(&self, _: i64) -> i32 {
        0
    }
}

impl Machine {
    /// Prepares a script: defines the types of VRML97 and the script's fields, and runs the
    /// program, which defines its functions.
    ///
    /// # Errors
    /// Returns why the program cannot run.
    pub(super) fn new(
        host: &Rc<Host>,
        program: &str,
        seed: u32,
        frame: f64,
    ) -> Result<Self, ScriptFailure> {
        let program = guarded(program).map_err(ScriptFailure::Error)?;
        let (interface, values) = interface(host);
        let meter = host.meter.clone();
        let context = ContextBuilder::new()
            .instructions_remaining(meter.instructions())
            .host_hooks(Rc::new(Hooks))
            .clock(Rc::new(SceneClock(host.world.clone())))
            .build();
        let mut context = context.map_err(|e| failure(&e, &meter))?;
        let limits = context.runtime_limits_mut();
        limits.set_recursion_limit(MAX_RECURSION);
        limits.set_stack_size_limit(MAX_STACK);
        let start = |context: &mut Context| -> JsResult<JsObject> {
            let prelude = context.eval(Source::from_bytes(PRELUDE.as_bytes()))?;
            let functions = host_object(host, 1.0 / frame, context);
            let fields = fields(&interface, &values, context);
            let given = [
                functions.into(),
                fields.into(),
                seed.into(),
                host.direct.into(),
            ];
            let api = match prelude.as_callable() {
                Some(prelude) => prelude.call(&JsValue::undefined(), &given, context)?,
                None => JsValue::undefined(),
            };
            context.eval(Source::from_bytes(program.as_bytes()))?;
            let none = || JsNativeError::error().with_message("the prelude returned nothing");
            Ok(api.as_object().ok_or_else(none)?)
        };
        let api = start(&mut context);
        meter.executed(
            meter
                .instructions()
                .saturating_sub(context.instructions_remaining()),
        );
        let api = api.map_err(|e| failure(&e, &meter))?;
        Ok(Self {
            context,
            api,
            interface,
            meter,
        })
    }

    /// Calls a function of the script, if it has it. Returns the values of the outputs that the
    /// script assigned.
    pub(super) fn call(&mut self, name: &str) -> (ScriptOutputs, Option<ScriptFailure>) {
        self.run("call", &[js_string!(name).into()])
    }

    /// Delivers an event to the function of its name.
    pub(super) fn receive(
        &mut self,
        event: &Event,
        time: f64,
    ) -> (ScriptOutputs, Option<ScriptFailure>) {
        let kind = script_input(&self.interface, &event.input);
        let value = kind.and_then(|kind| Some((kind, to_type(&event.value, kind)?)));
        let Some((kind, value)) = value else {
            return (Vec::new(), None);
        };
        let Some(type_name) = script_type(kind) else {
            return (Vec::new(), None);
        };
        let short = event.input.strip_prefix("set_").unwrap_or(&event.input);
        let exposed = self.interface.iter().find(|i| {
            i.access == Access::ExposedField && (*i.name == *event.input || *i.name == *short)
        });
        let exposed = exposed.map_or_else(JsValue::undefined, |i| js_string!(&*i.name).into());
        let data = to_data(&value, &mut self.context);
        let given = [
            js_string!(&*event.input).into(),
            js_string!(type_name).into(),
            data.into(),
            time.into(),
            exposed,
        ];
        self.run("receive", &given)
    }

    /// Calls a function of the prelude, and then collects the outputs.
    fn run(&mut self, name: &str, given: &[JsValue]) -> (ScriptOutputs, Option<ScriptFailure>) {
        let before = self.context.instructions_remaining();
        let called = self.method(name, given);
        let mut problem = called.err().map(|e| failure(&e, &self.meter));
        let mut outputs = Vec::new();
        if !matches!(problem, Some(ScriptFailure::Limit(_))) {
            match self.collect() {
                Ok(collected) => outputs = collected,
                Err(error) => problem = problem.or(Some(failure(&error, &self.meter))),
            }
        }
        let used = before.saturating_sub(self.context.instructions_remaining());
        self.meter.executed(used);
        if problem.is_none() && self.meter.is_used_up() {
            let limit = self.meter.too_many_instructions();
            problem = Some(ScriptFailure::Limit(limit));
        }
        (outputs, problem)
    }

    fn method(&mut self, name: &str, given: &[JsValue]) -> JsResult<JsValue> {
        let context = &mut self.context;
        let method = self.api.get(js_string!(name), context)?;
        let api = JsValue::from(self.api.clone());
        match method.as_callable() {
            Some(method) => method.call(&api, given, context),
            None => Ok(JsValue::undefined()),
        }
    }

    /// Returns the name and value of each output that the script assigned.
    fn collect(&mut self) -> JsResult<ScriptOutputs> {
        let collected = self.method("collect", &[])?;
        let mut outputs = Vec::new();
        for entry in items(&collected, &self.meter, &mut self.context)? {
            let parts = items(&entry, &self.meter, &mut self.context)?;
            let [name, _, data] = &parts[..] else {
                continue;
            };
            let name = text(name);
            if let Some(kind) = self.output_type(&name) {
                let value = from_data(data, kind, &self.meter, &mut self.context)?;
                outputs.push((name.into(), value));
            }
        }
        Ok(outputs)
    }

    fn output_type(&self, name: &str) -> Option<FieldType> {
        let short = name.strip_suffix("_changed").unwrap_or(name);
        let found = self.interface.iter().find(|i| match i.access {
            Access::EventOut => *i.name == *name,
            Access::ExposedField => *i.name == *short,
            Access::EventIn | Access::Field => false,
        });
        found.map(|i| i.kind)
    }
}

/// The name and value of each output that a script assigned.
pub(super) type ScriptOutputs = Vec<(Box<str>, Value)>;

/// Returns the interface of a script, and the values of its fields.
fn interface(host: &Host) -> (Vec<Interface>, Vec<Option<Value>>) {
    let world = host.world.borrow();
    let document = &world.document;
    let node = NodeRef {
        document,
        id: host.id,
    };
    let ClassRef::Extension(index) = node.data().class else {
        return (Vec::new(), Vec::new());
    };
    let interface = document.extensions[index as usize].interface.clone();
    let values = interface
        .iter()
        .map(|i| node.value(&i.name).cloned())
        .collect();
    (interface, values)
}

/// Returns the interface as the prelude takes it: access, type, name and data of each entry.
fn fields(interface: &[Interface], values: &[Option<Value>], context: &mut Context) -> JsArray {
    let mut entries = Vec::new();
    for (entry, value) in interface.iter().zip(values) {
        let Some(kind) = script_type(entry.kind) else {
            continue;
        };
        let data = match value {
            Some(value) if entry.access.has_value() => to_data(value, context).into(),
            _ => JsValue::undefined(),
        };
        let parts = [
            js_string!(entry.access.name()).into(),
            js_string!(kind).into(),
            js_string!(&*entry.name).into(),
            data,
        ];
        entries.push(JsArray::from_iter(parts, context).into());
    }
    JsArray::from_iter(entries, context)
}

/// Returns what an error of the engine means.
fn failure(error: &JsError, meter: &Meter) -> ScriptFailure {
    if let Some(limit) = meter.take_reached() {
        return ScriptFailure::Limit(limit);
    }
    match error.as_engine() {
        Some(EngineError::NoInstructionsRemain) => {
            ScriptFailure::Limit(meter.too_many_instructions())
        }
        Some(EngineError::RuntimeLimit(RuntimeLimitError::Recursion)) => {
            let limit = format!("its functions call each other more than {MAX_RECURSION} deep");
            ScriptFailure::Limit(limit)
        }
        Some(EngineError::RuntimeLimit(_)) => {
            ScriptFailure::Limit(format!("it uses more than {MAX_STACK} values at once"))
        }
        Some(EngineError::Panic(_)) => ScriptFailure::Limit("the engine failed".into()),
        None => {
            // The engine's own text adds places in the prelude.
            let text = match error.as_native() {
                Some(native) => format!("{}: {}", native.kind(), native.message()),
                None => error.to_string(),
            };
            let line = text.lines().next().unwrap_or_default();
            ScriptFailure::Error(line.chars().take(200).collect())
        }
    }
}
