"""Languages of lessons: their names, the one that a browser prefers, and the phrases around a lesson's text.

The app itself is in English; buttons keep their English names, so that a text can name them.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass

from app.window.teaching import ENGLISH

NAMES = {
    ENGLISH: "English",
    "ar": "العربية",
    "cs": "Čeština",
    "de": "Deutsch",
    "el": "Ελληνικά",
    "es": "Español",
    "fi": "Suomi",
    "fr": "Français",
    "he": "עברית",
    "hi": "हिन्दी",
    "hu": "Magyar",
    "id": "Bahasa Indonesia",
    "it": "Italiano",
    "ja": "日本語",
    "ko": "한국어",
    "nl": "Nederlands",
    "pl": "Polski",
    "pt": "Português",
    "ru": "Русский",
    "sv": "Svenska",
    "th": "ไทย",
    "tr": "Türkçe",
    "uk": "Українська",
    "vi": "Tiếng Việt",
    "zh": "中文",
}
"""Languages that a lesson may have, by their codes (ISO 639-1)."""
_PREFERRED = re.compile(
    r"\s*([a-z]{2,3})(?:-[a-z0-9-]+)?\s*(?:;\s*q=([01](?:\.\d{0,3})?))?\s*", re.IGNORECASE
)


def preferred(header: str, offered: Collection[str]) -> str:
    """Return the offered language that a browser prefers; English if it names none of them.

    Args:
        header: the browser's ``Accept-Language``, such as ``de-CH,de;q=0.9,en;q=0.8`` (RFC 9110, 12.5.4).
        offered: codes of the languages.
    """
    best, best_weight = ENGLISH, 0.0
    for part in header.split(","):
        found = _PREFERRED.fullmatch(part)
        if found is None:
            continue
        code, weight = found[1].lower(), float(found[2] or 1.0)
        if code in offered and weight > best_weight:
            best, best_weight = code, weight
    return best


@dataclass(frozen=True, slots=True)
class Phrases:
    """Texts in one language that the app adds to a lesson, as markdown."""

    begin: str
    """Shown before a stop is chosen."""
    guess: str
    """Shown below a question until there is a guess, like ``voting`` in a lecture."""
    first: str
    """Shown in place of ``guess`` if someone tried to go on without a guess."""
    voting: str
    computing: str
    """Shown after a guess, while the right choice depends on numbers that are computed."""
    right: str
    """Begins the answer to a right guess, and ``wrong`` that to a wrong one."""
    wrong: str
    place: str
    """For ``str.format`` with the number of the stop and the number of all stops."""
    space: str
    """Name of the space bar."""
    keys: str
    """The keys of the lesson: next, back, guess, skip, for ``str.format`` with the keys' names."""
    docked: str
    """Added to ``keys`` while a dock is shown."""
    dock_keys: str
    """Shown while the keys belong to the dock, for ``str.format`` with the key's name."""


PHRASES = {
    ENGLISH: Phrases(
        begin="Choose a stop, or press **Next**.",
        guess="Take a guess: 1, 2 or 3. Or press **Skip**.",
        first="**Guess before you go on: 1, 2 or 3.** A wrong guess costs nothing. Or press **Skip**.",
        voting="The class votes: 1, 2 or 3. The teacher's guess, or **Skip**, shows the answer.",
        computing="The answer depends on the scene: it appears when the numbers of this stop are computed, "
        "if they decide the question.",
        right="Right.",
        wrong="Not quite, and many think so.",
        place="({} of {})",
        space="space",
        keys="{} or {} next, {} back, {} guess, {} skip.",
        docked="After a click on the dock, the keys control the dock.",
        dock_keys="The keys control the dock now; {} returns them to the lesson.",
    ),
    "de": Phrases(
        begin="Wählen Sie eine Station, oder drücken Sie **Next** (weiter).",
        guess="Raten Sie: 1, 2 oder 3. Oder drücken Sie **Skip** (überspringen).",
        first="**Raten Sie zuerst: 1, 2 oder 3.** Falsch zu raten kostet nichts. Oder drücken Sie **Skip**.",
        voting="Der Kurs stimmt ab: 1, 2 oder 3. Wenn die Lehrkraft rät oder **Skip** drückt, erscheint die "
        "Antwort.",
        computing="Die Antwort hängt von der Szene ab: Sie erscheint, sobald die Zahlen dieser Station "
        "berechnet sind, falls sie die Frage entscheiden.",
        right="Richtig.",
        wrong="Nicht ganz, aber das denken viele.",
        place="({} von {})",
        space="Leertaste",
        keys="{} oder {} weiter, {} zurück, {} raten, {} überspringen.",
        docked="Nach einem Klick auf die Leiste unten steuern die Tasten diese Leiste.",
        dock_keys="Die Tasten steuern jetzt die Leiste unten; mit {} steuern sie wieder die Lektion.",
    ),
    "es": Phrases(
        begin="Elige una parada, o pulsa **Next** (siguiente).",
        guess="Adivina: 1, 2 o 3. O pulsa **Skip** (saltar).",
        first="**Adivina antes de seguir: 1, 2 o 3.** Equivocarse no cuesta nada. O pulsa **Skip**.",
        voting="La clase vota: 1, 2 o 3. Cuando quien enseña responde o pulsa **Skip**, sale la respuesta.",
        computing="La respuesta depende de la escena: sale en cuanto se calculan los números de esta parada, "
        "si deciden la pregunta.",
        right="Correcto.",
        wrong="No del todo, aunque mucha gente lo cree.",
        place="({} de {})",
        space="espacio",
        keys="{} o {} siguiente, {} atrás, {} adivinar, {} saltar.",
        docked="Tras un clic en la barra inferior, las teclas controlan esa barra.",
        dock_keys="Las teclas controlan ahora la barra inferior; con {} vuelven a la lección.",
    ),
    "th": Phrases(
        begin="เลือกตอน หรือกด **Next** (ถัดไป)",
        guess="ลองทายดู: 1, 2 หรือ 3 หรือกด **Skip** (ข้าม)",
        first="**ทายก่อนไปต่อ: 1, 2 หรือ 3** ทายผิดก็ไม่เสียอะไร หรือกด **Skip**",
        voting="ทั้งชั้นลงคะแนน: 1, 2 หรือ 3 เมื่อผู้สอนทายหรือกด **Skip** คำตอบจะปรากฏ",
        computing="คำตอบขึ้นอยู่กับฉาก และจะปรากฏเมื่อคำนวณตัวเลขของตอนนี้เสร็จ หากตัวเลขตัดสินคำถามได้",
        right="ถูกต้อง",
        wrong="ยังไม่ใช่ และหลายคนก็คิดเช่นนี้",
        place="({} จาก {})",
        space="เว้นวรรค",
        keys="{} หรือ {} ถัดไป, {} ย้อนกลับ, {} ทาย, {} ข้าม",
        docked="เมื่อคลิกที่แถบด้านล่าง ปุ่มจะควบคุมแถบนั้น",
        dock_keys="ตอนนี้ปุ่มควบคุมแถบด้านล่าง กด {} เพื่อกลับมาควบคุมบทเรียน",
    ),
}
"""Phrases by language code; a lesson in any other language has the English ones."""


def phrases_of(language: str) -> Phrases:
    """Return the phrases in a language, in English if there are none."""
    return PHRASES.get(language, PHRASES[ENGLISH])
