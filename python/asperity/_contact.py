"""The contact of a surface under loads: numbers and maps."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any, Dict, Iterator

import numpy as np
from numpy.typing import NDArray

from asperity._arrays import Reals
from asperity._table import Table, reals
from asperity._topography import Topography

if TYPE_CHECKING:
    from asperity import _asperity


class ContactState:
    """The contact under one load.

    Attributes
    ----------
    index : int
        The number of the load, from 0 on.
    """

    def __init__(self, pressing: "_asperity.Pressing", index: int) -> None:
        self._pressing = pressing
        self.index = index

    @property
    def row(self) -> Dict[str, Any]:
        """All numbers of the load, by the names of columns."""
        table = Table(self._pressing.table())
        return {name: table[name][self.index] for name in table.names}

    @property
    def load(self) -> float:
        """Mean pressure, in units of E* × rms slope."""
        return float(self.row["load"])

    @property
    def area(self) -> float:
        """Fraction of the nodes in contact."""
        return float(np.mean(self.contact()))

    def pressure(self) -> Reals:
        """See :meth:`Contact.pressure`."""
        return self._pressing.pressure(self.index)

    def gap(self) -> Reals:
        """See :meth:`Contact.gap`."""
        return self._pressing.gap(self.index)

    def displacement(self) -> Reals:
        """See :meth:`Contact.displacement`."""
        return self._pressing.displacement(self.index)

    def contact(self) -> NDArray[np.bool_]:
        """See :meth:`Contact.contact`."""
        return self._pressing.contact(self.index)

    def __repr__(self) -> str:
        row = self.row
        return (
            f"<asperity.ContactState: load {row['load']:g}, area {self.area:.4f}, {row['stop']} after "
            f"{row['pairs']} pairs of transforms>"
        )


class Contact:
    """What came of pressing a surface: a row and maps for each load.

    Lengths are in the unit of the surface, pressures in that of `effective_modulus`.

    Attributes
    ----------
    topography : Topography
        The surface.
    """

    def __init__(self, pressing: "_asperity.Pressing", topography: Topography) -> None:
        self._pressing = pressing
        self.topography = topography
        self._table = Table(pressing.table())

    @property
    def table(self) -> Table:
        """A row for each load: load, pressure, nodes in contact, mean gap, energy, peak pressure, how it ended …"""
        return self._table

    @property
    def load(self) -> Reals:
        """Mean pressures, in units of E* × rms slope; shape (loads,)."""
        return reals(self._table, "load")

    @property
    def mean_pressure(self) -> Reals:
        """Mean pressures, in the unit of the modulus; shape (loads,)."""
        return reals(self._table, "pressure")

    @property
    def area(self) -> Reals:
        """Fractions of the nodes in contact, as counted; shape (loads,)."""
        nodes_x, nodes_y = self.topography.nodes
        return reals(self._table, "contact_nodes") / (nodes_x * nodes_y)

    @property
    def mean_gap(self) -> Reals:
        """Mean distance of the surfaces; shape (loads,)."""
        return reals(self._table, "mean_gap")

    @property
    def converged(self) -> bool:
        """Whether no load was given up."""
        return all(stop in ("converged", "full-contact") for stop in self._table["stop"])

    def pressure(self, load: int) -> Reals:
        """The contact pressure [x, y] under a load, by its number; exactly zero where there is no contact.

        Raises
        ------
        IndexError
            If there is no such load, or ``fields=False`` has kept no pressures.
        """
        return self._pressing.pressure(self._place(load))

    def gap(self, load: int) -> Reals:
        """The distance of the surfaces [x, y]: zero in contact, the depth of yielding, negative, where
        the material yields.

        Raises
        ------
        IndexError
            As :meth:`pressure`.
        """
        return self._pressing.gap(self._place(load))

    def displacement(self, load: int) -> Reals:
        """The displacement of the elastic body [x, y], positive into it; of zero mean where periodic.

        Raises
        ------
        IndexError
            As :meth:`pressure`.
        """
        return self._pressing.displacement(self._place(load))

    def contact(self, load: int) -> NDArray[np.bool_]:
        """Which nodes [x, y] are in contact.

        Raises
        ------
        IndexError
            If there is no such load.
        """
        return self._pressing.contact(self._place(load))

    def _place(self, load: int) -> int:
        place = load + len(self) if load < 0 else load
        if not 0 <= place < len(self):
            raise IndexError(f"load {load} of {len(self)}")
        return place

    def __len__(self) -> int:
        return len(self._table)

    def __getitem__(self, load: int) -> ContactState:
        return ContactState(self._pressing, self._place(load))

    def __iter__(self) -> Iterator[ContactState]:
        return (self[load] for load in range(len(self)))

    def __repr__(self) -> str:
        if len(self) == 0:
            return "<asperity.Contact: no load>"
        load, area = self.load, self.area
        return (
            f"<asperity.Contact: {len(self)} loads {load[0]:g} … {load[-1]:g}, "
            f"area {area[0]:.4f} … {area[-1]:.4f}>"
        )

    def _repr_html_(self) -> str:
        from asperity._picture import picture

        def draw(axes: Any) -> None:
            heaviest = self.contact(len(self) - 1)
            axes.imshow(heaviest.T, origin="lower", cmap="Greys", interpolation="nearest")
            axes.set_title(f"contact under {self.load[-1]:g} E* × rms slope", fontsize="small")

        image = picture(draw) if len(self) else ""
        return f"<p>{escape(repr(self))}</p>{image}{self._table._repr_html_()}"
