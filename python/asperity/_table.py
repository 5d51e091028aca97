"""Tables, which any library that knows Arrow reads."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any, List, NamedTuple, Union

import numpy as np
from numpy.typing import NDArray

from asperity.errors import UnknownNameError

if TYPE_CHECKING:
    from asperity import _asperity

#: Rows and columns that are shown: a table of a study may have any number of both.
_ROWS_SHOWN = 12
_COLUMNS_SHOWN = 16


class Column(NamedTuple):
    """What a column holds.

    Attributes
    ----------
    name : str
        Its name.
    type : str
        ``real``, ``integer``, ``flag``, ``text``, ``bytes`` or ``reals``.
    role : str
        ``parameter``, ``surface``, ``load``, ``result`` or ``heavy``.
    unit : str
        Unit of its values; ``1`` for pure numbers.
    meaning : str
        One phrase that says what it is.
    """

    name: str
    type: str
    role: str
    unit: str
    meaning: str


class Table:
    """Rows under named columns, each with unit and meaning.

    A table speaks Arrow's interface for Python: ``polars.DataFrame(table)``, ``pyarrow.table(table)``
    and DuckDB (``duckdb.from_arrow(pyarrow.table(table))``) read its memory, without a copy. Role, unit
    and meaning of columns are the metadata of its fields.

    Examples
    --------
    >>> import asperity
    >>> wave = asperity.surface(method="wave", nodes=32, amplitude=0.01)
    >>> table = asperity.press(wave, loads=[0.1, 0.2]).table
    >>> len(table), table["load"]
    (2, array([0.1, 0.2]))
    >>> table.column("mean_gap").meaning
    'mean distance of the surfaces'
    """

    def __init__(self, table: "_asperity.Table") -> None:
        self._table = table

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        """The rows, as a capsule of Arrow's C stream interface."""
        return self._table.__arrow_c_stream__(requested_schema)

    def __arrow_c_schema__(self) -> object:
        """The columns, as a capsule of Arrow's C data interface."""
        return self._table.__arrow_c_schema__()

    def __len__(self) -> int:
        return self._table.rows()

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __getitem__(self, name: str) -> Union[NDArray[Any], List[Any]]:
        """A column as an array, copied: NaN where a number is not known; text, bytes and lists as a list.

        Raises
        ------
        UnknownNameError
            If there is no such column.
        """
        return self._table.column(name)

    @property
    def names(self) -> List[str]:
        """Names of the columns, in order."""
        return self._table.names()

    @property
    def columns(self) -> List[Column]:
        """What the columns hold, in order."""
        return [Column(*words) for words in self._table.descriptions()]

    def column(self, name: str) -> Column:
        """What the column of this name holds.

        Raises
        ------
        UnknownNameError
            If there is no such column.
        """
        for column in self.columns:
            if column.name == name:
                return column
        raise UnknownNameError(f"the table has no column `{name}`: {', '.join(self.names)}")

    def to_polars(self) -> Any:
        """The table as a ``polars.DataFrame``; takes polars."""
        import polars

        return polars.DataFrame(self)

    def to_pandas(self) -> Any:
        """The table as a ``pandas.DataFrame``; takes pandas and pyarrow."""
        import pyarrow

        return pyarrow.table(self).to_pandas()

    def __repr__(self) -> str:
        return f"<asperity.Table: {len(self)} rows × {len(self.names)} columns: {', '.join(self.names)}>"

    def _repr_html_(self) -> str:
        columns = self.columns[:_COLUMNS_SHOWN]
        heads = "".join(
            f'<th title="{escape(column.meaning)} [{escape(column.unit)}]">{escape(column.name)}</th>'
            for column in columns
        )
        rows = "".join(
            "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells[:_COLUMNS_SHOWN]) + "</tr>"
            for cells in self._table.cells(_ROWS_SHOWN)
        )
        size = f"{len(self)} rows × {len(self.names)} columns"
        return f"<table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table><p>{size}</p>"


def reals(table: Table, name: str) -> NDArray[np.float64]:
    """A column of numbers."""
    return np.asarray(table[name], dtype=np.float64)
