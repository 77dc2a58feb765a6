MODULE Übergabe
  ! Größe in mm, Werkstück
  VAR num varÖlcüm:=1;
  PROC prüfen()
    Set di_cilindro_Uñas_Ret;
    TPWrite "Schweißpunkt äöü ÿ";
  ENDPROC
ENDMODULE
