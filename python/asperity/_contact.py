"""Results of pressing a surface: a table row and maps for each load."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any, Dict, Iterator, Optional

import numpy as np
from numpy.typing import NDArray

from asperity._arrays import Reals
from asperity._table import Table, reals
from asperity._topography import Topography

if TYPE_CHECKING:
    from asperity import _asperity


class ContactState:
    """Contact at one load, or at one state of a path with adhesion.

    Attributes
    ----------
    index : int
        Index of the load or state, from 0.
    """

    def __init__(self, pressing: "_asperity.Pressing", index: int) -> None:
        self._pressing = pressing
        self.index = index

    @property
    def row(self) -> Dict[str, Any]:
        """Row of the table for this load, by column names."""
        table = Table(self._pressing.table())
        return {name: table[name][self.index] for name in table.names}

    @property
    def load(self) -> float:
        """Load: mean pressure in units of E* × rms slope."""
        return float(self.row["load"])

    @property
    def area(self) -> float:
        """Counted contact area: fraction of the nodes in contact."""
        return float(np.mean(self.contact()))

    def pressure(self) -> Reals:
        """Returns the contact pressure, shape (n_x, n_y); see :meth:`Contact.pressure`."""
        return self._pressing.pressure(self.index)

    def gap(self) -> Reals:
        """Returns the gap between the surfaces, shape (n_x, n_y); see :meth:`Contact.gap`."""
        return self._pressing.gap(self.index)

    def displacement(self) -> Reals:
        """Returns the displacement of the elastic body, shape (n_x, n_y); see :meth:`Contact.displacement`."""
        return self._pressing.displacement(self.index)

    def contact(self) -> NDArray[np.bool_]:
        """Returns the contact map, shape (n_x, n_y): True for nodes in contact."""
        return self._pressing.contact(self.index)

    def repulsive(self) -> NDArray[np.bool_]:
        """Returns the map of the nodes with positive pressure, shape (n_x, n_y); see :meth:`Contact.repulsive`."""
        return self._pressing.repulsive(self.index)

    def __repr__(self) -> str:
        row = self.row
        return (
            f"<asperity.ContactState: load {row['load']:g}, area {self.area:.4f}, {row['stop']} after "
            f"{row['pairs']} pairs of transforms>"
        )


class Contact:
    """Result of pressing a surface: a table row and maps for each load.

    With adhesion, the rows and maps are those of the states of the path, in its order. Where this class says
    load, it then means state. With a hardness and a `path`, they are those of the loads of each branch in
    ascending order: first loading, then unloading from each maximum. Lengths are in the unit of the surface, and
    pressures in the unit of `effective_modulus` (default: units of E*). Each call returns a new array.

    Attributes
    ----------
    topography : Topography
        The pressed surface; with `against`, the sum of both.
    """

    def __init__(self, pressing: "_asperity.Pressing", topography: Topography) -> None:
        self._pressing = pressing
        self.topography = topography
        self._table = Table(pressing.table())

    @property
    def table(self) -> Table:
        """Table with a row for each load: load, pressure, nodes in contact, mean gap, energy, …"""
        return self._table

    @property
    def partial_slip(self) -> Optional[Table]:
        """Table of partial slip with a row for each normal and tangential load; None without `friction`."""
        slip = self._pressing.partial_slip()
        return None if slip is None else Table(slip)

    @property
    def load(self) -> Reals:
        """Loads: mean pressures in units of E* × rms slope, shape (loads,)."""
        return reals(self._table, "load")

    @property
    def mean_pressure(self) -> Reals:
        """Mean pressures in the unit of the modulus, shape (loads,)."""
        return reals(self._table, "pressure")

    @property
    def area(self) -> Reals:
        """Counted contact areas: fractions of the nodes in contact, shape (loads,)."""
        nodes_x, nodes_y = self.topography.nodes
        return reals(self._table, "contact_nodes") / (nodes_x * nodes_y)

    @property
    def repulsive_area(self) -> Reals:
        """Fractions of the nodes with positive pressure, shape (loads,).

        They differ from `area` only with adhesion.
        """
        if "repulsive_fraction" in self._table.names:
            return reals(self._table, "repulsive_fraction")
        return self.area

    @property
    def mean_gap(self) -> Reals:
        """Mean gaps in the unit of the surface, shape (loads,); NaN after pull-off."""
        return reals(self._table, "mean_gap")

    @property
    def converged(self) -> bool:
        """True if all loads have converged, and states of a path have reached their mean gaps."""
        unconverged = ("pair-limit", "not-reached", "stalled", "gap-not-reached")
        return all(stop not in unconverged for stop in self._table["stop"])

    def pressure(self, load: int) -> Reals:
        """Returns the contact pressure in the unit of the modulus, shape (n_x, n_y); zero outside the contact.

        With adhesion, it is negative where the surfaces attract each other.

        Parameters
        ----------
        load : int
            Index of the load; negative indices count from the last load.

        Raises
        ------
        IndexError
            If there is no such load, or if ``fields=False`` was given, which stores no pressures.
        """
        return self._pressing.pressure(self._index(load))

    def gap(self, load: int) -> Reals:
        """Returns the gap between the surfaces in the unit of the surface, shape (n_x, n_y).

        The gap is zero in elastic contact. Where the material yields, it is negative, and its magnitude is
        the depth of the yielding. After pull-off it is infinite.

        Raises
        ------
        IndexError
            As :meth:`pressure`.
        """
        return self._pressing.gap(self._index(load))

    def displacement(self, load: int) -> Reals:
        """Returns the displacement of the elastic body in the unit of the surface, shape (n_x, n_y).

        It is positive into the body. The mean displacement of a periodic body is zero.

        Raises
        ------
        IndexError
            As :meth:`pressure`.
        """
        return self._pressing.displacement(self._index(load))

    def contact(self, load: int) -> NDArray[np.bool_]:
        """Returns the contact map, shape (n_x, n_y): True for nodes in contact.

        Raises
        ------
        IndexError
            If there is no such load.
        """
        return self._pressing.contact(self._index(load))

    def repulsive(self, load: int) -> NDArray[np.bool_]:
        """Returns the map of the nodes with positive pressure, shape (n_x, n_y).

        It differs from the contact map only with adhesion, under which nodes in contact can pull.

        Raises
        ------
        IndexError
            If there is no such load.
        """
        return self._pressing.repulsive(self._index(load))

    def _index(self, load: int) -> int:
        index = load + len(self) if load < 0 else load
        if not 0 <= index < len(self):
            raise IndexError(f"no load {load}: there are {len(self)} loads")
        return index

    def __len__(self) -> int:
        return len(self._table)

    def __getitem__(self, load: int) -> ContactState:
        return ContactState(self._pressing, self._index(load))

    def __iter__(self) -> Iterator[ContactState]:
        return (self[load] for load in range(len(self)))

    def __repr__(self) -> str:
        if len(self) == 0:
            return "<asperity.Contact: no load>"
        load, area = self.load, self.area
        if len(self) == 1:
            return f"<asperity.Contact: 1 load {load[0]:g}, area {area[0]:.4f}>"
        return (
            f"<asperity.Contact: {len(self)} loads {load[0]:g} … {load[-1]:g}, "
            f"area {area[0]:.4f} … {area[-1]:.4f}>"
        )

    def _repr_html_(self) -> str:
        from asperity._picture import picture

        def draw(axes: Any) -> None:
            # The states of a path may end with a separation.
            heaviest = int(np.argmax(self.load))
            axes.imshow(self.contact(heaviest).T, origin="lower", cmap="Greys", interpolation="nearest")
            axes.set_title(f"contact under {self.load[heaviest]:g} E* × rms slope", fontsize="small")

        image = picture(draw) if len(self) else ""
        return f"<p>{escape(repr(self))}</p>{image}{self._table._repr_html_()}"
