//! No branch and no loop of a shader depends on uniform buffers alone: lavapipe of Mesa 22.3 compiles such a
//! kernel anew for every dispatch (`unfolded` in shaders/shared/numerics.wgsl).

use std::fs;
use std::path::Path;

use cumuli::gpu::ShaderLibrary;
use naga::{AddressSpace, Block, Expression, Function, Handle, Module, Statement};

/// What a value depends on, as far as the driver follows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Depends {
    Nothing,
    Uniforms,
    More,
}
use Depends::{More, Nothing, Uniforms};

/// One function with what its arguments depend on in one call.
struct Walk<'a> {
    module: &'a Module,
    function: &'a Function,
    arguments: Vec<Depends>,
    locals: Vec<Depends>,
    calls: Vec<(Handle<Expression>, Depends)>,
    returns: Depends,
    found: Vec<String>,
}

impl<'a> Walk<'a> {
    fn new(module: &'a Module, function: &'a Function, arguments: Vec<Depends>) -> Self {
        let locals = function.local_variables.iter();
        let locals = locals.map(|_| Nothing).collect();
        Self {
            module,
            function,
            arguments,
            locals,
            calls: Vec::new(),
            returns: Nothing,
            found: Vec::new(),
        }
    }

    /// Local variables depend on what is stored in them, also later in a loop: again until nothing changes.
    fn run(mut self) -> (Depends, Vec<String>) {
        loop {
            let before = self.locals.clone();
            self.found.clear();
            let body = &self.function.body;
            self.block(body);
            if self.locals == before {
                return (self.returns, self.found);
            }
        }
    }

    fn of(&self, handle: Handle<Expression>) -> Depends {
        let of_all = |handles: &[Handle<Expression>]| {
            handles.iter().map(|&h| self.of(h)).max().unwrap_or(Nothing)
        };
        match self.function.expressions[handle] {
            Expression::Literal(_)
            | Expression::Constant(_)
            | Expression::Override(_)
            | Expression::ZeroValue(_) => Nothing,
            Expression::FunctionArgument(index) => self.arguments[index as usize],
            Expression::GlobalVariable(global) => {
                match self.module.global_variables[global].space {
                    AddressSpace::Uniform => Uniforms,
                    _ => More,
                }
            }
            Expression::LocalVariable(local) => self.locals[local.index()],
            Expression::Load { pointer } => self.of(pointer),
            // The driver follows loads from constant places only.
            Expression::Access { base, index } => {
                if self.of(index) == Nothing {
                    self.of(base)
                } else {
                    More
                }
            }
            Expression::AccessIndex { base, .. } => self.of(base),
            Expression::Splat { value, .. } => self.of(value),
            Expression::Swizzle { vector, .. } => self.of(vector),
            Expression::Compose { ref components, .. } => of_all(components),
            Expression::Unary { expr, .. } | Expression::As { expr, .. } => self.of(expr),
            Expression::Relational { argument, .. } => self.of(argument),
            Expression::Binary { left, right, .. } => of_all(&[left, right]),
            Expression::Select { condition, accept, reject } => {
                of_all(&[condition, accept, reject])
            }
            Expression::Math { arg, arg1, arg2, arg3, .. } => {
                let all: Vec<_> = [Some(arg), arg1, arg2, arg3].into_iter().flatten().collect();
                of_all(&all)
            }
            Expression::CallResult(_) => self
                .calls
                .iter()
                .rev()
                .find(|(result, _)| *result == handle)
                .map_or(More, |(_, depends)| *depends),
            _ => More,
        }
    }

    fn condition(&mut self, handle: Handle<Expression>) {
        if self.of(handle) == Uniforms {
            let name = self.function.name.clone().unwrap_or_else(|| "an entry point".to_owned());
            self.found.push(name);
        }
    }

    /// The local variable that a pointer leads to.
    fn local(&self, mut pointer: Handle<Expression>) -> Option<usize> {
        loop {
            pointer = match self.function.expressions[pointer] {
                Expression::LocalVariable(local) => return Some(local.index()),
                Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => base,
                _ => return None,
            };
        }
    }

    fn raise(&mut self, pointer: Handle<Expression>, depends: Depends) {
        if let Some(local) = self.local(pointer) {
            self.locals[local] = self.locals[local].max(depends);
        }
    }

    fn block(&mut self, block: &Block) {
        for statement in block {
            match *statement {
                Statement::Block(ref inner) => self.block(inner),
                Statement::If { condition, ref accept, ref reject } => {
                    self.condition(condition);
                    self.block(accept);
                    self.block(reject);
                }
                Statement::Switch { selector, ref cases } => {
                    self.condition(selector);
                    for case in cases {
                        self.block(&case.body);
                    }
                }
                Statement::Loop { ref body, ref continuing, break_if } => {
                    self.block(body);
                    self.block(continuing);
                    if let Some(condition) = break_if {
                        self.condition(condition);
                    }
                }
                Statement::Store { pointer, value } => self.raise(pointer, self.of(value)),
                Statement::Call { function, ref arguments, result } => {
                    for &argument in arguments {
                        self.raise(argument, More);
                    }
                    let depends = arguments.iter().map(|&a| self.of(a)).collect();
                    let (returns, found) =
                        Walk::new(self.module, &self.module.functions[function], depends).run();
                    self.found.extend(found);
                    if let Some(result) = result {
                        self.calls.push((result, returns));
                    }
                }
                Statement::Return { value: Some(value) } => {
                    self.returns = self.returns.max(self.of(value))
                }
                _ => {}
            }
        }
    }
}

fn branches_on_uniforms(module: &Module) -> Vec<String> {
    let mut found = Vec::new();
    for entry in &module.entry_points {
        let arguments = vec![More; entry.function.arguments.len()];
        let (_, of_entry) = Walk::new(module, &entry.function, arguments).run();
        found.extend(of_entry.into_iter().map(|function| format!("{}: {function}", entry.name)));
    }
    found.sort();
    found.dedup();
    found
}

#[test]
fn no_branch_depends_on_uniforms_alone() {
    let library = ShaderLibrary::new().expect("modules");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let mut kernels = 0;
    let mut found = Vec::new();
    for folder in ["frame", "bench", "tables"] {
        for entry in fs::read_dir(root.join(folder)).expect("a folder of shaders") {
            let path = entry.expect("an entry").path();
            let name = path.display().to_string();
            let text = fs::read_to_string(&path).expect(&name);
            if text.contains("#define_import_path ") {
                continue;
            }
            for def in ["LIT", "ABSORBING", "OCTAVES", "ALONE", "GRIDLESS"] {
                let composed =
                    library.compose(&name, &text, &[("STEPS", 4), ("SCREEN_TILE", 8), (def, 1)]);
                let composed = composed.unwrap_or_else(|e| panic!("{name}: {e}"));
                kernels += composed.entry_points.len();
                found.extend(
                    branches_on_uniforms(&composed).into_iter().map(|at| format!("{name}: {at}")),
                );
            }
        }
    }
    assert!(kernels > 60, "{kernels} kernels");
    assert!(found.is_empty(), "branches on uniforms alone:\n{}", found.join("\n"));
}

/// The walk sees such branches where they are: direct, through a function, at the end of a loop.
#[test]
fn branches_on_uniforms_are_seen() {
    let seen = |body: &str| {
        let text = format!(
            "struct U {{ a: u32, b: array<vec4<u32>, 4> }}
             @group(0) @binding(0) var<uniform> u: U;
             @group(0) @binding(1) var<storage, read_write> s: array<u32>;
             fn same(x: u32) -> u32 {{ return x + 1u; }}
             fn branch(x: u32) -> u32 {{ if x == 3u {{ return 1u; }} return 2u; }}
             @compute @workgroup_size(1) fn main(@builtin(global_invocation_id) id: vec3<u32>) {{ {body} }}"
        );
        let module = naga::front::wgsl::parse_str(&text)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
        !branches_on_uniforms(&module).is_empty()
    };
    assert!(seen("if u.a == 1u { s[0] = 1u; }"));
    assert!(seen("if same(u.a) == 1u { s[0] = 1u; }"));
    assert!(seen("s[0] = branch(u.a);"));
    assert!(seen("for (var i = 0u; i < u.a; i++) { s[i] = 1u; }"));
    assert!(seen("switch u.b[2].x { case 1u: { s[0] = 1u; } default: {} }"));
    assert!(!seen("if u.a == id.x { s[0] = branch(s[1]); }"));
    assert!(!seen("if u.b[id.x].x == 1u { s[0] = 1u; }"));
    assert!(!seen("for (var i = 0u; i < select(u.a, 0u, id.x == 7u); i++) { s[i] = 1u; }"));
    assert!(!seen("for (var i = 0u; i < 3u; i++) { s[i] = u.a; }"));
}
