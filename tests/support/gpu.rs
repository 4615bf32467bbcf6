//! One test at a time on the graphics device, and what was logged meanwhile.

use std::{
    fmt::Debug,
    sync::{Mutex, MutexGuard, Once, PoisonError},
};

use tracing::{
    Event, Level, Metadata, Subscriber,
    field::{Field, Visit},
    span,
};

static DEVICE: Mutex<()> = Mutex::new(());
static MESSAGES: Mutex<Vec<String>> = Mutex::new(Vec::new());
static LISTEN: Once = Once::new();

/// The right to use the graphics device: a software driver takes all cores, and its messages belong to one test.
pub struct Gpu(#[expect(dead_code, reason = "held for its lock")] MutexGuard<'static, ()>);

/// Waits for the graphics device. Warnings and errors are listened to from here on.
pub fn gpu() -> Gpu {
    // A test that failed has poisoned the lock; the device is none the worse for it.
    let guard = DEVICE.lock().unwrap_or_else(PoisonError::into_inner);
    LISTEN.call_once(|| {
        // Where another subscriber is first, nothing is heard, and tests of messages fail rather than pass.
        let _ = tracing::subscriber::set_global_default(Listener);
    });
    messages().clear();
    Gpu(guard)
}

fn messages() -> MutexGuard<'static, Vec<String>> {
    MESSAGES.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Gpu {
    /// Warnings and errors since the test began, but for what comes of having no graphics card, and of several apps in
    /// one process.
    pub fn messages(&self) -> Vec<String> {
        let expected = ["Could not set global", "only supports software rendering"];
        let told = |message: &&String| !expected.iter().any(|words| message.contains(words));
        messages().iter().filter(told).cloned().collect()
    }
}

/// Keeps warnings and errors.
struct Listener;

impl Subscriber for Listener {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() <= Level::WARN
    }

    fn new_span(&self, _: &span::Attributes<'_>) -> span::Id {
        span::Id::from_u64(1)
    }

    fn record(&self, _: &span::Id, _: &span::Record<'_>) {}

    fn record_follows_from(&self, _: &span::Id, _: &span::Id) {}

    fn event(&self, event: &Event<'_>) {
        let mut text = format!("{} {}:", event.metadata().level(), event.metadata().target());
        event.record(&mut Fields(&mut text));
        messages().push(text);
    }

    fn enter(&self, _: &span::Id) {}

    fn exit(&self, _: &span::Id) {}
}

struct Fields<'a>(&'a mut String);

impl Visit for Fields<'_> {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        let name = if field.name() == "message" { String::new() } else { format!("{}=", field.name()) };
        self.0.push_str(&format!(" {name}{value:?}"));
    }
}
