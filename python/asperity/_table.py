"""Tables for Python, readable by every library that supports Arrow."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any, Dict, List, NamedTuple, Union

import numpy as np
from numpy.typing import NDArray

from asperity.errors import UnknownNameError

if TYPE_CHECKING:
    from asperity import _asperity

#: Maximum numbers of rows and columns in the HTML view.
_ROWS_SHOWN = 12
_COLUMNS_SHOWN = 16


class Column(NamedTuple):
    """Description of a column.

    Attributes
    ----------
    name : str
        Name of the column.
    type : str
        ``real``, ``integer``, ``flag``, ``text``, ``bytes`` or ``reals``.
    role : str
        ``parameter``, ``surface``, ``load``, ``result`` or ``heavy``.
    unit : str
        Unit of the values; ``1`` for pure numbers.
    meaning : str
        Meaning of the values, in one phrase.
    """

    name: str
    type: str
    role: str
    unit: str
    meaning: str


class Table:
    """Table whose columns have units and meanings.

    A table implements Arrow's PyCapsule interface: ``polars.DataFrame(table)``, ``pyarrow.table(table)``
    and DuckDB (``duckdb.from_arrow(pyarrow.table(table))``) read it without a copy. The metadata of the
    Arrow fields contain role, unit and meaning of the columns.

    Examples
    --------
    >>> import asperity
    >>> wave = asperity.surface(method="wave", nodes=32, amplitude=0.01)
    >>> table = asperity.press(wave, loads=[0.1, 0.2]).table
    >>> len(table), table["load"]
    (2, array([0.1, 0.2]))
    >>> table.column("mean_gap").meaning
    'mean gap between the surfaces'
    >>> table.units["load"]
    'E* × rms slope'
    """

    def __init__(self, table: "_asperity.Table") -> None:
        self._table = table

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        """Exports the rows as a capsule of Arrow's C stream interface."""
        return self._table.__arrow_c_stream__(requested_schema)

    def __arrow_c_schema__(self) -> object:
        """Exports the schema as a capsule of Arrow's C data interface."""
        return self._table.__arrow_c_schema__()

    def __len__(self) -> int:
        return self._table.rows()

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __getitem__(self, name: str) -> Union[NDArray[Any], List[Any]]:
        """Returns a copy of a column: an array with NaN for nulls, or a list of texts, bytes or lists.

        Raises
        ------
        UnknownNameError
            If there is no such column.
        """
        return self._table.column(name)

    @property
    def names(self) -> List[str]:
        """Names of the columns."""
        return self._table.names()

    @property
    def columns(self) -> List[Column]:
        """Descriptions of the columns."""
        return [Column(*words) for words in self._table.descriptions()]

    @property
    def units(self) -> Dict[str, str]:
        """Units of the columns by name; ``1`` for pure numbers and empty for texts."""
        return {column.name: column.unit for column in self.columns}

    @property
    def meanings(self) -> Dict[str, str]:
        """Meanings of the columns by name."""
        return {column.name: column.meaning for column in self.columns}

    def column(self, name: str) -> Column:
        """Returns the description of a column.

        Raises
        ------
        UnknownNameError
            If there is no such column.
        """
        for column in self.columns:
            if column.name == name:
                return column
        raise UnknownNameError(f"the table has no column `{name}`; available: {', '.join(self.names)}")

    def to_polars(self) -> Any:
        """Converts the table to a ``polars.DataFrame``; requires polars.

        A polars frame has no place for units; :attr:`units` and :attr:`meanings` have them by column name.
        """
        import polars

        return polars.DataFrame(self)

    def to_pandas(self) -> Any:
        """Converts the table to a ``pandas.DataFrame``; requires pandas and pyarrow.

        ``frame.attrs["units"]`` and ``frame.attrs["meanings"]`` are dicts by column name.
        """
        import pyarrow

        frame = pyarrow.table(self).to_pandas()
        frame.attrs.update(units=self.units, meanings=self.meanings)
        return frame

    def __repr__(self) -> str:
        return f"<asperity.Table: {len(self)} rows × {len(self.names)} columns: {', '.join(self.names)}>"

    def _repr_html_(self) -> str:
        columns = self.columns[:_COLUMNS_SHOWN]
        heads = "".join(
            f'<th title="{escape(column.meaning)}">{escape(column.name + _in_brackets(column.unit))}</th>'
            for column in columns
        )
        rows = "".join(
            "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells[:_COLUMNS_SHOWN]) + "</tr>"
            for cells in self._table.cells(_ROWS_SHOWN)
        )
        size = f"{len(self)} rows × {len(self.names)} columns"
        return f"<table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table><p>{size}</p>"


def _in_brackets(unit: str) -> str:
    return "" if unit in ("", "1") else f" [{unit}]"


def reals(table: Table, name: str) -> NDArray[np.float64]:
    """Returns a column as a float64 array."""
    return np.asarray(table[name], dtype=np.float64)
