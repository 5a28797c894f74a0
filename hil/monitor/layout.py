"""Which panels stand where. Every page fits 80 by 24; on a large terminal the first page shows them all."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Container, Horizontal, Vertical
from textual.widget import Widget

from hil.monitor import bus_panels, model_panels, signal_panels
from hil.monitor.panel import LogPanel, Panel

LEAST_COLUMNS, LEAST_ROWS = 80, 24

WIDE_COLUMNS, WIDE_ROWS = 130, 40
"""From here on the first page has room for everything."""

PAGES = ("overview", "model", "resonance", "bus", "log")

CSS = """
Screen { layers: base; background: ansi_default; color: ansi_default; }
.panel { width: 1fr; height: 1fr; background: ansi_default; color: ansi_default; }
.headline { height: 1; text-style: bold; }
.message { height: 1; }
.standing { height: 2; }
.keys { height: 1; text-style: reverse; }
.page { height: 1fr; display: none; }
.page.shown { display: block; }
.left { width: 3fr; padding-right: 1; }
.right { width: 2fr; }
.torque, .speed { height: 3fr; }
.prbs { height: 2fr; }
.twist { height: 3fr; }
.response { height: 3fr; }
.figures { height: 5; }
.brief { height: 7; }
.wide-only { display: none; }
Screen.wide .wide-only { display: block; }
Screen.wide .brief { height: 9; }
.dialog { width: 76; max-width: 100%; height: auto; max-height: 100%; border: ascii ansi_default; padding: 0 1;
          background: ansi_default; color: ansi_default; }
StartDialog, HelpDialog { align: center middle; background: ansi_default; }
MarkDialog { align: center bottom; background: transparent; }
MarkDialog > .dialog { width: 100%; }
.lead { text-style: bold; margin-bottom: 1; }
OptionList { height: auto; max-height: 8; border: none; background: ansi_default; color: ansi_default; }
OptionList > .option-list--option-highlighted { background: ansi_default; color: ansi_default; text-style: bold; }
OptionList:focus > .option-list--option-highlighted {
  background: ansi_default; color: ansi_default; text-style: bold; }
#summary { margin-top: 1; }
#question { text-style: bold; margin-top: 1; }
Input, Input:focus { border: ascii ansi_default; height: 3; background: ansi_default; color: ansi_default; }
#too-small { display: none; height: 1fr; text-style: bold; }
Screen.small #too-small { display: block; }
Screen.small .page.shown { display: none; }
"""

MOST_CHANNELS = 4
"""Lines that further channels take from the plots of the first page."""


def page(name: str, *parts: Widget) -> Container:
    """Put widgets on a page of their own."""
    return Container(*parts, id=name, classes="page")


def _channels(count: int) -> list[Panel]:
    """Give the further channels a panel, where there are any."""
    panel = Panel(signal_panels.channels, "channels")
    panel.styles.height = min(count, MOST_CHANNELS)
    return [panel] if count else []


def pages(channels: int = 0) -> ComposeResult:
    """Give every page, in the order of `PAGES`, with room for so many further channels."""
    yield page(
        "overview",
        Horizontal(
            Vertical(
                Panel(signal_panels.torque, "torque"),
                Panel(signal_panels.speed, "speed"),
                *_channels(channels),
                Panel(signal_panels.prbs, "prbs"),
                Panel(signal_panels.twist, "twist"),
                classes="left",
            ),
            Vertical(
                Panel(model_panels.response, "response"),
                Vertical(
                    Panel(model_panels.poles, "poles"),
                    classes="wide-only",
                ),
                Panel(model_panels.figures, "figures"),
                Panel(bus_panels.health_summary, "brief"),
                classes="right",
            ),
        ),
    )
    yield page(
        "model",
        Vertical(
            Panel(model_panels.response, "response-page"),
            Panel(model_panels.poles, "poles-page"),
            Panel(model_panels.standing, "standing"),
        ),
    )
    yield page(
        "resonance",
        Vertical(
            Panel(model_panels.resonance, "resonance-history"),
            Panel(model_panels.damping, "damping-history"),
            Panel(model_panels.alarms, "alarms"),
            Panel(model_panels.standing, "standing"),
        ),
    )
    yield page("bus", Panel(bus_panels.full, "bus-page"))
    yield page("log", LogPanel())
