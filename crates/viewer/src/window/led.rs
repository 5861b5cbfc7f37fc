//! Tools that are led by keys, with one hand, while the mouse has the other one.

use std::sync::Arc;

use eframe::egui::{self, Key};
use pliant_geometry::Vector3;

use super::App;
use super::picture::{OPEN, TURN};
use crate::hand::{Hand, Point};

/// Speed of a tool while a key is held: heights of the picture in a second. The keys turn it like this many
/// points of the mouse, and open its jaws like this many of the wheel.
const SPEED: f64 = 0.15;
const TURNS: f64 = 60.0;
const OPENS: f64 = 300.0;
/// Largest duration of a frame [s].
const LONGEST: f64 = 0.1;

impl App {
    /// Takes hold of the next tool with a hand that is free, or lets go after the last one.
    pub(super) fn take_next_tool(&mut self) {
        let other = self.mouse.other();
        let free = if self.hands[other as usize].is_some() { self.mouse } else { other };
        let (next, which) = self.led.map_or((0, free), |(led, which)| (led + 1, which));
        if self.hands[which as usize].take().is_some() {
            self.act_with(which, Hand::Release);
        }
        let tools = Arc::clone(&self.frame.tool_triangles);
        self.led = tools.get(next).map(|_| (next, which));
        let Some(&triangle) = tools.get(next) else { return };
        let Some(corners) = self.port.subject.triangles().nth(triangle as usize) else { return };
        let middle = corners.iter().map(|&point| self.port.points[point as usize]).sum::<Vector3>() / 3.0;
        self.take_with(which, Point { triangle, weights: [1.0 / 3.0; 3] }, middle);
    }

    /// Moves the tool that keys lead: arrows across the view, Page Up and Page Down along it; with Shift
    /// arrows turn it; Home and End open and close its jaws.
    pub(super) fn lead_tool(&mut self, context: &egui::Context) {
        let Some((_, which)) = self.led else { return };
        let Some(at) = self.hands[which as usize] else { return };
        let (seconds, shift) =
            context.input(|input| (f64::from(input.stable_dt).min(LONGEST), input.modifiers.shift));
        let held = |plus, minus| {
            let is = |key| f64::from(u8::from(context.input(|input| input.key_down(key))));
            is(plus) - is(minus)
        };
        let [right, up, towards] = self.port.camera.axes();
        let [x, y] = [held(Key::ArrowRight, Key::ArrowLeft), held(Key::ArrowUp, Key::ArrowDown)];
        let (depth, opening) = (held(Key::PageDown, Key::PageUp), held(Key::Home, Key::End));
        if shift && (x, y) != (0.0, 0.0) {
            let turn = (up * x - right * y) * (TURNS * TURN * seconds);
            self.act_with(which, Hand::Turn(turn.into()));
        } else if (x, y, depth) != (0.0, 0.0, 0.0) {
            let to =
                at + (right * x + up * y + towards * depth) * (SPEED * self.port.camera.height * seconds);
            self.hands[which as usize] = Some(to);
            self.act_with(which, Hand::Pull(to.into()));
        }
        if opening != 0.0 {
            self.act_with(which, Hand::Open(OPENS * OPEN * opening * seconds));
        }
        if [x, y, depth, opening].iter().any(|way| *way != 0.0) {
            context.request_repaint();
        }
    }
}
