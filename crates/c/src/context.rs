//! The context: a table of the open items of a program. A handle holds a place in the table and how often
//! that place was used. So a closed handle is recognised, however often its place is used again.

use std::mem::MaybeUninit;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pliant_sim::panicked;

use crate::open::{OpenScene, OpenSnapshot, Shared};
use crate::status::{Fault, PliantError, PliantStatus, reported};

/// Table of everything that a program has open. Opened by `pliant_context_open`.
pub struct PliantContext {
    slots: Mutex<Vec<Slot>>,
}

/// A place of the table.
struct Slot {
    /// Number of times that the place was used.
    uses: u32,
    item: Option<Item>,
}

/// Target of a handle.
#[derive(Clone)]
pub(crate) enum Item {
    Scene(Arc<Mutex<OpenScene>>),
    Simulation(Arc<Shared>),
    Snapshot(Arc<OpenSnapshot>),
}

impl Item {
    fn kind(&self) -> &'static str {
        match self {
            Self::Scene(_) => "scene",
            Self::Simulation(_) => "simulation",
            Self::Snapshot(_) => "snapshot",
        }
    }
}

impl PliantContext {
    pub(crate) fn new() -> Self {
        Self { slots: Mutex::new(Vec::new()) }
    }

    fn slots(&self) -> MutexGuard<'_, Vec<Slot>> {
        // Nothing panics while it is held.
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Gives a thing a handle.
    pub(crate) fn open(&self, item: Item) -> u64 {
        let mut slots = self.slots();
        let free = slots.iter().position(|slot| slot.item.is_none() && slot.uses < u32::MAX);
        let at = free.unwrap_or_else(|| {
            slots.push(Slot { uses: 0, item: None });
            slots.len() - 1
        });
        let slot = &mut slots[at];
        slot.uses += 1;
        slot.item = Some(item);
        u64::from(slot.uses) << 32 | at as u64
    }

    fn item(&self, handle: u64) -> Result<Item, Fault> {
        let mut slots = self.slots();
        let slot = found(&mut slots, handle)?;
        slot.item.clone().ok_or_else(closed)
    }

    /// Takes a handle out of the table. Steps under way end.
    pub(crate) fn close(&self, handle: u64) -> Result<(), Fault> {
        let mut slots = self.slots();
        let item = found(&mut slots, handle)?.item.take().ok_or_else(closed)?;
        // The item is dropped outside of the lock on the table.
        drop(slots);
        if let Item::Simulation(shared) = &item {
            shared.stop();
        }
        Ok(())
    }

    pub(crate) fn scene(&self, handle: u64) -> Result<Arc<Mutex<OpenScene>>, Fault> {
        match self.item(handle)? {
            Item::Scene(scene) => Ok(scene),
            other => Err(wrong("scene", &other)),
        }
    }

    pub(crate) fn simulation(&self, handle: u64) -> Result<Arc<Shared>, Fault> {
        match self.item(handle)? {
            Item::Simulation(simulation) => Ok(simulation),
            other => Err(wrong("simulation", &other)),
        }
    }

    pub(crate) fn snapshot(&self, handle: u64) -> Result<Arc<OpenSnapshot>, Fault> {
        match self.item(handle)? {
            Item::Snapshot(snapshot) => Ok(snapshot),
            other => Err(wrong("snapshot", &other)),
        }
    }
}

fn closed() -> Fault {
    Fault::new(PliantStatus::Closed, "the handle is closed")
}

/// The place of a handle that was not used again since.
fn found(slots: &mut [Slot], handle: u64) -> Result<&mut Slot, Fault> {
    let (at, uses) = (handle as u32 as usize, (handle >> 32) as u32);
    match slots.get_mut(at) {
        Some(slot) if slot.uses == uses => Ok(slot),
        Some(slot) if (1..slot.uses).contains(&uses) => Err(closed()),
        _ => Err(Fault::new(PliantStatus::BadHandle, format!("{handle:#x} is no handle of this context"))),
    }
}

fn wrong(wanted: &str, given: &Item) -> Fault {
    Fault::new(PliantStatus::BadHandle, format!("the handle is of a {}, not of a {wanted}", given.kind()))
}

/// The border: executes a call, and reports errors and panics to the caller. A panic closes the handle of the
/// call.
///
/// # Safety
/// `context` and `error` are null or point to values of their types.
pub(crate) unsafe fn call(
    context: *const PliantContext,
    handle: u64,
    error: *mut PliantError,
    what: impl FnOnce(&PliantContext) -> Result<(), Fault>,
) -> PliantStatus {
    // SAFETY: as the caller promises.
    let (context, error) = unsafe { (context.as_ref(), error.cast::<MaybeUninit<PliantError>>().as_mut()) };
    let Some(context) = context else {
        return reported(Err(Fault::new(PliantStatus::Null, "the context is null")), error);
    };
    let result = catch_unwind(AssertUnwindSafe(|| what(context))).unwrap_or_else(|panic| {
        let _ = context.close(handle);
        Err(Fault::new(
            PliantStatus::Internal,
            format!("Pliant panicked: {}; the handle is closed", panicked(&*panic)),
        ))
    });
    reported(result, error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lock::lock;
    use pliant_format::source::Source;

    fn scene(context: &PliantContext) -> u64 {
        let source = Source::parse("scene.toml", "").unwrap();
        context.open(Item::Scene(Arc::new(Mutex::new(OpenScene::new(source, ".".into())))))
    }

    #[test]
    fn a_context_is_shared_between_threads() {
        fn shared<T: Send + Sync>(_: &T) {}
        shared(&PliantContext::new());
    }

    #[test]
    fn a_handle_that_was_closed_stays_closed_when_its_place_is_used_again() {
        let context = PliantContext::new();
        let first = scene(&context);
        context.close(first).unwrap();
        let second = scene(&context);
        assert!(first as u32 == second as u32 && first != second);
        let status = |handle| context.scene(handle).err().map(|fault| fault.status);
        assert_eq!(
            [first, second, second + (1 << 32), 7, 0].map(status),
            [
                Some(PliantStatus::Closed),
                None,
                Some(PliantStatus::BadHandle),
                Some(PliantStatus::BadHandle),
                Some(PliantStatus::BadHandle),
            ]
        );
    }

    #[test]
    fn a_panic_becomes_a_status_and_closes_the_handle() {
        let context = PliantContext::new();
        let handle = scene(&context);
        let mut error = MaybeUninit::<PliantError>::uninit();
        // SAFETY: the context and the error are alive.
        let status = unsafe {
            call(&raw const context, handle, error.as_mut_ptr(), |context| {
                let _held = lock(&*context.scene(handle)?)?.world();
                panic!("a defect")
            })
        };
        assert_eq!(status, PliantStatus::Internal);
        // SAFETY: a call that fails writes its error.
        let message = unsafe { error.assume_init() }.message.map(|byte| byte as u8);
        assert!(message.starts_with(b"Pliant panicked: a defect"));
        assert_eq!(context.scene(handle).err().unwrap().status, PliantStatus::Closed);
    }
}
