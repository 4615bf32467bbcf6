//! No shader branches on uniforms alone.
//!
//! Lavapipe writes the values of uniforms that decide branches and loops into the shader and compiles it again whenever
//! the buffer is bound anew: each frame took half a second longer until all of a flight's values had occurred once, and
//! no compiled shader was ever freed. What is fixed for a pipeline is a shader definition, the rest is arithmetic.
//!
//! Values are followed through variables, members of structs, arguments and results of functions.

use std::collections::HashMap;

use naga::{AddressSpace, Block, Expression, Function, Handle, LocalVariable, Module, Statement, TypeInner};

use super::modules;

/// What a value depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Source {
    /// Literals, constants and counters.
    Constant,
    /// A uniform at a fixed position, and constants.
    Uniform,
    /// Anything else.
    Other,
}

/// The sources of a value: one for each member of a struct that a function has put together, else a single one.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Sources(Vec<Source>);

impl Sources {
    fn one(source: Source) -> Self {
        Self(vec![source])
    }

    fn all(&self) -> Source {
        self.0.iter().copied().max().unwrap_or(Source::Constant)
    }

    fn member(&self, index: u32) -> Self {
        if self.0.len() > 1 { Self::one(self.0[index as usize]) } else { self.clone() }
    }

    /// A value that is this one or `other`.
    fn or(&self, other: &Self) -> Self {
        if self.0.len() == other.0.len() {
            Self(self.0.iter().zip(&other.0).map(|(a, b)| *a.max(b)).collect())
        } else {
            let (long, short) = if self.0.len() > other.0.len() { (self, other) } else { (other, self) };
            Self(long.0.iter().map(|source| (*source).max(short.all())).collect())
        }
    }
}

/// The functions of a module, entry points last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Name {
    Function(Handle<Function>),
    Entry(usize),
}

/// What is known of all values that live longer than an expression.
#[derive(Clone, Default, PartialEq, Eq)]
struct Flow {
    variables: HashMap<(Name, Handle<LocalVariable>), Sources>,
    arguments: HashMap<(Name, u32), Sources>,
    results: HashMap<Name, Sources>,
}

struct Reader<'a> {
    module: &'a Module,
    name: Name,
    function: &'a Function,
}

impl Reader<'_> {
    fn sources(&self, flow: &Flow, expression: Handle<Expression>) -> Sources {
        let of = |inner: Handle<Expression>| self.sources(flow, inner);
        let all = |parts: &[Handle<Expression>]| {
            Sources::one(parts.iter().map(|part| of(*part).all()).max().unwrap_or(Source::Constant))
        };
        match self.function.expressions[expression] {
            Expression::Literal(_)
            | Expression::Constant(_)
            | Expression::Override(_)
            | Expression::ZeroValue(_)
            | Expression::ArrayLength(_)
            | Expression::ImageQuery { .. } => Sources::one(Source::Constant),
            Expression::LocalVariable(variable) => {
                flow.variables.get(&(self.name, variable)).cloned().unwrap_or(Sources::one(Source::Constant))
            }
            Expression::FunctionArgument(index) => match self.name {
                Name::Function(_) => {
                    flow.arguments.get(&(self.name, index)).cloned().unwrap_or(Sources::one(Source::Constant))
                }
                Name::Entry(_) => Sources::one(Source::Other),
            },
            Expression::CallResult(callee) => {
                flow.results.get(&Name::Function(callee)).cloned().unwrap_or(Sources::one(Source::Constant))
            }
            Expression::GlobalVariable(global) => Sources::one(match self.module.global_variables[global].space {
                AddressSpace::Uniform => Source::Uniform,
                _ => Source::Other,
            }),
            Expression::Compose { ty, ref components } => match self.module.types[ty].inner {
                TypeInner::Struct { .. } => Sources(components.iter().map(|part| of(*part).all()).collect()),
                _ => all(components),
            },
            Expression::Access { base, index } => all(&[base, index]),
            Expression::AccessIndex { base, index } => of(base).member(index),
            Expression::Splat { value, .. } => of(value),
            Expression::Swizzle { vector, .. } => of(vector),
            Expression::Load { pointer } => of(pointer),
            Expression::Unary { expr, .. } | Expression::As { expr, .. } => of(expr),
            Expression::Relational { argument, .. } => of(argument),
            Expression::Binary { left, right, .. } => all(&[left, right]),
            Expression::Select { condition, accept, reject } => all(&[condition, accept, reject]),
            Expression::Math { arg, arg1, arg2, arg3, .. } => {
                all(&[Some(arg), arg1, arg2, arg3].into_iter().flatten().collect::<Vec<_>>())
            }
            _ => Sources::one(Source::Other),
        }
    }

    /// The variable that `pointer` leads to, and the member of it, if it is a struct.
    fn variable(&self, pointer: Handle<Expression>) -> Option<(Handle<LocalVariable>, Option<u32>)> {
        match self.function.expressions[pointer] {
            Expression::LocalVariable(variable) => Some((variable, None)),
            Expression::AccessIndex { base, index } => {
                let (variable, member) = self.variable(base)?;
                Some((variable, member.or(Some(index))))
            }
            Expression::Access { base, .. } => self.variable(base),
            _ => None,
        }
    }

    /// The number of a variable's members that are followed one by one.
    fn members(&self, variable: Handle<LocalVariable>) -> usize {
        match &self.module.types[self.function.local_variables[variable].ty].inner {
            TypeInner::Struct { members, .. } => members.len(),
            _ => 1,
        }
    }

    /// Takes up what the statements of `block` write, pass to functions and return.
    fn follow(&self, flow: &mut Flow, block: &Block) {
        for statement in block {
            match *statement {
                Statement::Block(ref inner) => self.follow(flow, inner),
                Statement::If { ref accept, ref reject, .. } => {
                    self.follow(flow, accept);
                    self.follow(flow, reject);
                }
                Statement::Switch { ref cases, .. } => {
                    cases.iter().for_each(|case| self.follow(flow, &case.body));
                }
                Statement::Loop { ref body, ref continuing, .. } => {
                    self.follow(flow, body);
                    self.follow(flow, continuing);
                }
                Statement::Store { pointer, value } => {
                    let Some((variable, member)) = self.variable(pointer) else { continue };
                    let (written, count) = (self.sources(flow, value), self.members(variable));
                    let written = match member.filter(|_| count > 1) {
                        Some(member) => {
                            let mut members = vec![Source::Constant; count];
                            members[member as usize] = written.all();
                            Sources(members)
                        }
                        None => written,
                    };
                    let known = flow.variables.entry((self.name, variable));
                    let known = known.or_insert_with(|| Sources(vec![Source::Constant; count]));
                    *known = known.or(&written);
                }
                Statement::Call { function, ref arguments, .. } => {
                    for (index, argument) in arguments.iter().enumerate() {
                        let given = self.sources(flow, *argument);
                        let known = flow.arguments.entry((Name::Function(function), index as u32));
                        let known = known.or_insert_with(|| given.clone());
                        *known = known.or(&given);
                    }
                }
                Statement::Return { value: Some(value) } => {
                    let returned = self.sources(flow, value);
                    let known = flow.results.entry(self.name).or_insert_with(|| returned.clone());
                    *known = known.or(&returned);
                }
                _ => {}
            }
        }
    }

    /// Number of branches and loops in `block` that depend on uniforms alone.
    fn steered(&self, flow: &Flow, block: &Block) -> usize {
        let by_uniform = |condition| usize::from(self.sources(flow, condition).all() == Source::Uniform);
        let within = |block: &Block| self.steered(flow, block);
        block
            .iter()
            .map(|statement| match statement {
                Statement::Block(inner) => within(inner),
                Statement::If { condition, accept, reject } => by_uniform(*condition) + within(accept) + within(reject),
                Statement::Switch { selector, cases } => {
                    by_uniform(*selector) + cases.iter().map(|case| within(&case.body)).sum::<usize>()
                }
                Statement::Loop { body, continuing, break_if } => {
                    break_if.map_or(0, by_uniform) + within(body) + within(continuing)
                }
                _ => 0,
            })
            .sum()
    }
}

/// Names of the functions that branch on uniforms alone, entry points included.
fn functions_steered(module: &Module) -> Vec<String> {
    let functions =
        module.functions.iter().map(|(handle, function)| Reader { module, name: Name::Function(handle), function });
    let entries = module.entry_points.iter().enumerate();
    let entries = entries.map(|(index, entry)| Reader { module, name: Name::Entry(index), function: &entry.function });
    let readers: Vec<Reader> = functions.chain(entries).collect();
    let mut flow = Flow::default();
    loop {
        let before = flow.clone();
        readers.iter().for_each(|reader| reader.follow(&mut flow, &reader.function.body));
        if flow == before {
            break;
        }
    }
    let name = |reader: &Reader| match reader.name {
        Name::Function(_) => reader.function.name.clone().unwrap_or_default(),
        Name::Entry(index) => module.entry_points[index].name.clone(),
    };
    readers.iter().filter(|reader| reader.steered(&flow, &reader.function.body) > 0).map(name).collect()
}

#[test]
fn no_shader_branches_on_uniforms_alone() {
    for (name, module) in modules() {
        assert_eq!(functions_steered(&module), Vec::<String>::new(), "{name}");
    }
}

#[test]
fn branches_on_uniforms_are_found() {
    let source = "
        struct Flags { count: vec4<f32>, on: f32 }
        @group(0) @binding(0) var<uniform> flags: Flags;
        struct Surface { gloss: f32, albedo: f32 }
        fn early(color: f32) -> f32 { if flags.on <= 0.0 { return color; } return 2.0 * color; }
        fn counted() -> f32 {
            let last = i32(flags.count.x) - 1;
            var sum = 0.0;
            for (var i = 0; i < last; i += 1) { sum += 1.0; }
            return sum;
        }
        fn mixed(color: f32) -> f32 { if color > flags.on { return 0.0; } return color; }
        fn fixed() -> f32 { var sum = 0.0; for (var i = 0; i < 4; i += 1) { sum += flags.on; } return sum; }
        fn glossy(surface: Surface) -> f32 { if surface.gloss > 0.0 { return 1.0; } return surface.albedo; }
        fn bright(surface: Surface) -> f32 { if surface.albedo > 0.0 { return 1.0; } return surface.gloss; }
        fn is_on() -> bool { return flags.on > 0.0; }
        fn by_result() -> f32 { var on = is_on(); if on { return 1.0; } return 0.0; }
        @fragment fn fragment(@location(0) x: f32) -> @location(0) vec4<f32> {
            var surface: Surface;
            surface.gloss = flags.on;
            surface.albedo = x;
            return vec4(early(x), counted() + glossy(surface), mixed(x) + bright(surface), fixed() + by_result());
        }";
    let module = naga::front::wgsl::parse_str(source).expect("the source is valid");
    assert_eq!(functions_steered(&module), ["early", "counted", "glossy", "by_result"]);
}
