import pytest

from render_worker.people.outfit import sample_outfit


@pytest.mark.parametrize("feminine", [True, False])
def test_the_same_seed_dresses_the_same(feminine):
    assert sample_outfit(5, feminine=feminine) == sample_outfit(5, feminine=feminine)
    assert sample_outfit(5, feminine=feminine) != sample_outfit(6, feminine=feminine)


def test_everybody_wears_shoes_something_on_the_legs_and_a_top():
    for seed in range(100):
        shoes, bottom, top = sample_outfit(seed, feminine=seed % 2 == 0).garments
        assert shoes.highest < bottom.lowest + 0.1
        assert bottom.highest > top.lowest, "skin shows at the waist"
        assert top.sleeve > 0


def test_only_women_wear_skirts_and_only_men_have_beards():
    women = [sample_outfit(seed, feminine=True) for seed in range(100)]
    men = [sample_outfit(seed, feminine=False) for seed in range(100)]
    assert any(garment.part == "skirt" for outfit in women for garment in outfit.garments)
    assert not any(garment.part == "skirt" for outfit in men for garment in outfit.garments)
    assert {outfit.stubble for outfit in women} == {0.0}
    assert len({outfit.stubble for outfit in men}) > 1


def test_seeds_of_any_size_are_taken():
    for seed in (-1, 2**32 - 1, 2**63 - 1):
        sample_outfit(seed, feminine=False)
