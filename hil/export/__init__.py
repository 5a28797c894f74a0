"""The on-line estimator for other machines: IEC 61131-3 Structured Text for the vehicle's PLC."""
