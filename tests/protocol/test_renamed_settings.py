import re

import msgspec
import pytest

from protocol.config import RunConfig
from protocol.config_file import load_config
from protocol.errors import InvalidConfig
from protocol.renamed_settings import RENAMED


@pytest.mark.parametrize(("old", "new"), RENAMED.items())
def test_an_old_name_is_refused_with_the_new_one(tmp_path, old, new):
    section, _, key = old.rpartition(".")
    path = tmp_path / "run.toml"
    path.write_text(f"[{section}]\n{key} = 1\n")
    with pytest.raises(InvalidConfig, match=re.escape(f"{old} is {section}.{new}")):
        load_config(path)


@pytest.mark.parametrize(("old", "new"), RENAMED.items())
def test_the_new_name_is_a_setting_and_the_old_one_is_none(old, new):
    section, _, key = old.rpartition(".")
    table = msgspec.to_builtins(RunConfig())
    for name in section.split("."):
        table = table[name]
    assert new in table
    assert key not in table
